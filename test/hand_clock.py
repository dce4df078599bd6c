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

"""A clock for tests of what goes by one."""


class HandClock:
    """A clock that is set by hand, and counts how often it is read; or a module ``time``."""

    def __init__(self, now):
        self.now = now
        self.read = 0

    def __call__(self):
        self.read += 1
        return self.now

    monotonic = __call__
