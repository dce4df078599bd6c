# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Run each lab once for all tests of a process that use its report."""

import functools

from tf_tree_py.labs.catalogue import LABS

# A copy of LABS, because a test may replace its entries.
_RUN = {name: lab.run for name, lab in LABS.items()}


@functools.cache
def report_of(name):
    """Return the report of a lab without ROS."""
    return _RUN[name]()


def rows_of(name, number=0):
    """Return the rows of a lab's table as dictionaries."""
    return report_of(name).tables[number].as_dict()['rows']
