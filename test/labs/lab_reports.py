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
