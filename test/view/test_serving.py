# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages to pages from threads."""

import asyncio
import threading
from types import SimpleNamespace

from programs import PATIENCE_S
import pytest
from tf_tree_py.view.serving import wake_only_in_loop

pytest.importorskip('viser', reason='pages need viser')


def client_of(buffer):
    return SimpleNamespace(
        _websock_connection=SimpleNamespace(get_message_buffer=lambda: buffer))


def test_all_messages_of_a_thread_arrive():
    from viser._messages import RunJavascriptMessage
    from viser.infra._async_message_buffer import AsyncMessageBuffer
    count = 3000

    async def received():
        buffer = AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=False,
                                    window_duration_sec=0.0)
        wake_only_in_loop(client_of(buffer))
        errors = []

        def send():
            try:
                for number in range(count):
                    buffer.push(RunJavascriptMessage(str(number)))
            except RuntimeError as error:
                errors.append(error)

        sender = threading.Thread(target=send)
        found = []
        sender.start()
        async for window in buffer.window_generator(1):
            found += [message.source for message in window]
            if found and found[-1] == str(count - 1):
                break
        sender.join()
        assert not errors
        return found

    found = asyncio.run(asyncio.wait_for(received(), PATIENCE_S))
    assert found == [str(number) for number in range(count)]


def test_event_is_set_in_the_loop_alone():
    async def states():
        loop = asyncio.get_running_loop()
        event = asyncio.Event()
        wake_only_in_loop(client_of(SimpleNamespace(message_event=event, event_loop=loop)))
        waiting = asyncio.create_task(event.wait())
        await asyncio.sleep(0)
        await asyncio.to_thread(event.set)
        in_a_thread = event.is_set()
        await asyncio.to_thread(loop.call_soon_threadsafe, event.set)
        await asyncio.wait_for(waiting, PATIENCE_S)
        return in_a_thread, event.is_set()

    assert asyncio.run(states()) == (False, True)


def test_another_viser_is_left_alone():
    buffer = SimpleNamespace(queue=[])
    wake_only_in_loop(client_of(buffer))
    wake_only_in_loop(SimpleNamespace())
    assert vars(buffer) == {'queue': []}
