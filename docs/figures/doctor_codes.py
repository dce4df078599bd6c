# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Writes the codes of docs/doctor_codes.md anew: ``python docs/figures/doctor_codes.py``.

They are read from the catalogue that ``tf_doctor --list`` prints.
"""

from pathlib import Path

from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Check

PAGE = Path(__file__).parents[1] / 'doctor_codes.md'
BEGIN, END = '<!-- codes: begin -->\n', '<!-- codes: end -->\n'


def section(code: Check) -> str:
    """Return what the page says of a code."""
    explains = f'\n- symptoms: {", ".join(f"`{name}`" for name in sorted(code.explains))}' if (
        code.explains) else ''
    recorded = f'\n- fix in a recording: {code.recorded_fix}' if code.recorded_fix else ''
    return (f'#### `{code.name}`\n\n{code.severity.value.capitalize()}: {code.catches}.\n\n'
            f'- cause: {code.cause}\n- fix: {code.fix}{recorded}{explains}\n')


def sections() -> str:
    """Return the whole part of the page that lists the codes."""
    chapters = (('### Failure modes of the textbook', True), ('### What else goes wrong', False))
    return '\n'.join(part for heading, textbook in chapters for part in (
        f'{heading}\n', *(section(code) for code in CODES.values()
                          if code.textbook == textbook)))


def main() -> None:
    """Write the page."""
    before, _, rest = PAGE.read_text().partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(f'{before}{BEGIN}\n{sections()}\n{END}{after}')


if __name__ == '__main__':
    main()
