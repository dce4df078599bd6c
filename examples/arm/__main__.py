# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``scripts/arm``: a simulated arm picks a block that its camera sees."""

from collections.abc import Sequence
import sys

from tf_tree_py.command import signals
from tf_tree_py.command.endings import entry_point

from .options import NAME


def _work(argv: Sequence[str]) -> int:
    # A late import, because it is slow.
    from .command import run
    signals.raise_interrupts()
    return run(argv)


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
