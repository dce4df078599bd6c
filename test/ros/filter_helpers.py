# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers of the tests of the message filter: messages, and their callbacks."""

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
    """The calls of a filter's callbacks."""

    def __init__(self):
        self.delivered, self.dropped, self.threads = [], [], set()

    def receive(self, message, found):
        self.threads.add(threading.current_thread())
        self.delivered.append((message, found))

    def lose(self, message, drop, why):
        self.threads.add(threading.current_thread())
        self.dropped.append((message, drop, why))

    def xs(self):
        """Return the x of the message and of the transform of each delivery."""
        return [(message.point.x, found.transform.translation.x)
                for message, found in self.delivered]

    def stamps(self):
        return [message.header.stamp.sec for message, _ in self.delivered]

    def reasons(self):
        return [drop for _, drop, _ in self.dropped]


def run_callbacks(executor, message_filter):
    """Run all pending callbacks of a filter, in this thread."""
    while message_filter._ready or message_filter._notices:
        executor.spin_once(timeout_sec=0.0)


def check(counts):
    """Check that the counts account for every message."""
    assert counts.received == counts.delivered + sum(counts.dropped.values()) + counts.held
