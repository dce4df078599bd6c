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

"""What the tests of the message filter share: messages, and where they come out."""

import threading

from geometry_msgs.msg import PointStamped
from ros_helpers import at


def point(seconds, frame='base', x=0.0):
    message = PointStamped()
    message.header.frame_id = frame
    message.header.stamp = at(seconds).to_msg()
    message.point.x = x
    return message


class Inbox:
    """What a filter called back with."""

    def __init__(self):
        self.delivered, self.dropped, self.threads = [], [], set()

    def take(self, message, found):
        self.threads.add(threading.current_thread())
        self.delivered.append((message, found))

    def lose(self, message, drop, why):
        self.threads.add(threading.current_thread())
        self.dropped.append((message, drop, why))

    def xs(self):
        """Return of what was delivered the message's and the transform's x."""
        return [(message.point.x, found.transform.translation.x)
                for message, found in self.delivered]

    def stamps(self):
        return [message.header.stamp.sec for message, _ in self.delivered]

    def reasons(self):
        return [drop for _, drop, _ in self.dropped]


def check(counts):
    """Every message is accounted for."""
    assert counts.received == counts.delivered + sum(counts.dropped.values()) + counts.held
