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
