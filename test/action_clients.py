# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A correction of a race in rclpy's action client."""

import functools
import threading


def close_race(client):
    """
    Prevent an action client from taking a response before it has recorded the request.

    In Jazzy, the client sends a request first, and records its number afterwards. If another
    thread spins the node, it may take the response in between. The response is dropped, and its
    future never completes.
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
