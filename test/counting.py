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

"""Counting calls: which way something went, where the answers do not tell."""

from collections import Counter
from contextlib import contextmanager
import sys


@contextmanager
def calls():
    """Count the calls of every function; whoever calls it, by whatever name."""
    counted = Counter()

    def count(frame, event, _):
        if event == 'call':
            counted[frame.f_code] += 1

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        yield lambda function: counted[function.__code__]
    finally:
        sys.setprofile(before)
