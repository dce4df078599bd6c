# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Writes the codes of docs/doctor.md anew: ``python docs/figures/doctor_codes.py``.

They are read from the catalogue that ``tf_doctor --list`` prints.
"""

from pathlib import Path

from tf_tree_py.core.checks.catalogue import CODES
from tf_tree_py.core.checks.finding import Code

PAGE = Path(__file__).parents[1] / 'doctor.md'
BEGIN, END = '<!-- codes: begin -->\n', '<!-- codes: end -->\n'


def section(code: Code) -> str:
    """Return what the page says of a code."""
    explains = f'\n- symptoms: {", ".join(f"`{name}`" for name in sorted(code.explains))}' if (
        code.explains) else ''
    return (f'#### `{code.name}`\n\n{code.severity.value.capitalize()}: {code.catches}.\n\n'
            f'- cause: {code.cause}\n- fix: {code.fix}{explains}\n')


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
