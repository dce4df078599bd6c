# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""README's first program prints what README says; ``test/jazzy`` has the error of tf2."""

from contextlib import redirect_stdout
import io

from pages import BLOCKS

OWN = [block for block in BLOCKS if block.page == 'README.md']
PROGRAM = next(block for block in OWN if block.language == 'python')
PRINTED = next(block for block in OWN if block.language == 'text')


def test_first_program_prints_what_follows_it():
    assert 'rclpy' not in PROGRAM.code
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(PROGRAM.code, {})
    # README wraps the lines.
    assert printed.getvalue().split() == PRINTED.code.split()
