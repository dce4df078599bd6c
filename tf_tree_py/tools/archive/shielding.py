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

"""What each worker of our own loads first: Ctrl-C is for the process that started it."""

import signal


def dask_setup(worker: object) -> None:
    """Let this process end when it is told to, and not by a key; dask calls it by name."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
