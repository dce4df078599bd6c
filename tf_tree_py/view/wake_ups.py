# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Makes viser's messages safe to send from a thread.

viser 1.1 sets an ``asyncio.Event`` for each message in the thread that sends it, and again in the
thread of the event loop. asyncio allows only the second: the first can raise ``RuntimeError``, or
set the event without waking the task that waits for it. That task then sleeps forever, and the
page stays as it is. On a busy machine both happen within minutes.
"""

import asyncio
from typing import Any


def wake_only_in_loop(client: Any) -> None:
    """
    Let only the thread of the event loop set the event for new messages.

    :param client: viser's handle of a page. The handle of another version of viser, which has
        no such event, stays as it is.
    """
    try:
        buffer = client._websock_connection.get_message_buffer()
        event, loop = buffer.message_event, buffer.event_loop
    except AttributeError:
        return
    set_event = event.set

    def set_in_loop() -> None:
        if _running_loop() is loop:
            set_event()

    event.set = set_in_loop


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
