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

"""rclpy's action client, without its race."""

import functools
import threading


def close_race(client):
    """
    Let an action client take no answer before it knows what it has asked.

    In Jazzy it sends a request first, and notes its number after that. Where another thread spins
    its node, an answer may be taken in between: it is dropped, and whoever waits for it waits for
    ever.
    """
    lock = threading.RLock()

    def locked(method):
        @functools.wraps(method)
        def call(*arguments, **options):
            with lock:
                return method(*arguments, **options)
        return call

    for name in ('send_goal_async', '_get_result_async', 'take_data'):
        setattr(client, name, locked(getattr(client, name)))
    return client
