# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Run each lab once, as without ROS and matplotlib, for all tests of a process that use it."""

from contextlib import contextmanager
import functools
import sys

from tf_tree_py.labs.catalogue import LABS

# A copy of LABS, because a test may replace its entries.
_RUN = {name: lab.run for name, lab in LABS.items()}


@contextmanager
def _not_installed(*names):
    """Let imports of these packages fail, as if they were not installed."""
    installed = {name: sys.modules[name] for name in names if name in sys.modules}
    sys.modules.update(dict.fromkeys(names))
    try:
        yield
    finally:
        for name in names:
            del sys.modules[name]
        sys.modules.update(installed)


@functools.cache
def report_of(name):
    """Return the report of a lab; running it needs neither ROS nor matplotlib."""
    with _not_installed('rclpy', 'tf_tree_py.ros', 'matplotlib'):
        return _RUN[name]()


def rows_of(name, number=0):
    """Return the rows of a lab's table as dictionaries."""
    return report_of(name).tables[number].as_dict()['rows']
