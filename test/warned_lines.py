# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check that a warning names the line of the caller."""

import warnings


def assert_warns_at_its_line(call, *arguments):
    """Call a function whose body is on one line, and compare that line with the warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always', UserWarning)
        warnings.simplefilter('always', RuntimeWarning)
        call(*arguments)
    place = call.__code__.co_filename, call.__code__.co_firstlineno
    assert {(each.filename, each.lineno) for each in caught} == {place}
