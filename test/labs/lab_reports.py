"""Each lab is run once for all tests of a process that look at what it says."""

import functools

from tf_tree_py.labs.catalogue import LABS

# Apart from LABS, where a test may put something else.
_RUN = {name: lab.run for name, lab in LABS.items()}


@functools.cache
def report_of(name):
    """Return what a lab reports, without ROS."""
    return _RUN[name]()


def rows_of(name, number=0):
    """Return the rows of a lab's table as dictionaries."""
    return report_of(name).tables[number].as_dict()['rows']
