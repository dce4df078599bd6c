# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The order of locks that busy_nodes.py observes, and the table of locks in docs/design.md."""

from pathlib import Path

from lock_order import documented, INNERMOST, observed_by, undocumented

PROGRAM = Path(__file__).with_name('busy_nodes.py')
# Whatever the table says of these does happen.
EXACT = 'shared_buffer._lock', 'MessageFilter._lock', 'ClockWatch._lock', 'Queries._lock'


def test_busy_nodes_take_locks_in_the_documented_order():
    pairs = observed_by(PROGRAM)
    wrong = undocumented(pairs)
    assert not wrong, wrong
    table = documented()
    for lock in EXACT:
        taken = {taken for held, taken in pairs if held == lock} - {INNERMOST}
        assert taken == table[lock], lock
