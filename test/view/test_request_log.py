# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What clients and failing pages make the server print: a line a second, and counts."""

import asyncio
import os
import random
import socket

from conditions import until
from garbage import omitted, told
from hand_clock import clock_of_logs
from programs import PATIENCE_S
import pytest
from served_pages import log_of, pages_of
from tf_tree_py import BufferCore, Pose, UNLIMITED
from tf_tree_py.limited_log import LimitedLog

msgspec = pytest.importorskip('msgspec', reason='pages need viser')
viser = pytest.importorskip('viser', reason='pages need viser')

from tf_tree_py.view import serving as serving_module  # noqa: E402, I100 - it needs viser
from tf_tree_py.view.page.page import Page  # noqa: E402
from tf_tree_py.view.request_log import RequestLogger  # noqa: E402
from tf_tree_py.view.serving import Serving  # noqa: E402
from tf_tree_py.view.subject import Subject  # noqa: E402
from websockets.asyncio.client import connect  # noqa: E402
from websockets.exceptions import ConnectionClosed  # noqa: E402

HOST = '127.0.0.1'
COUNT = 100
CAMERA = {'type': 'ViewerCameraMessage', 'wxyz': [1.0, 0.0, 0.0, 0.0], 'position': [3.0] * 3,
          'fov': 1.0, 'near': 0.01, 'far': 100.0, 'image_height': 600, 'image_width': 800,
          'look_at': [0.0] * 3, 'up_direction': [0.0, 0.0, 1.0]}


@pytest.fixture
def clock(monkeypatch):
    return clock_of_logs(monkeypatch)


@pytest.fixture
def serving(clock):
    buffer = BufferCore(UNLIMITED)
    buffer.insert('map', 'base', 1, Pose())
    with Serving(Subject(buffer, False, lambda: 0), HOST, 18310, 'test') as serving:
        yield serving


def port_of(serving):
    return int(serving.url.rpartition(':')[2])


def send(serving, data):
    """Send bytes instead of a request, and wait until the server hangs up."""
    with socket.create_connection((HOST, port_of(serving)), PATIENCE_S) as connection:
        connection.sendall(data)
        connection.shutdown(socket.SHUT_WR)
        try:
            while connection.recv(4096):
                pass
        except ConnectionResetError:
            pass


def open_page(serving):
    return connect(f'ws://{HOST}:{port_of(serving)}', subprotocols=[f'viser-v{viser.__version__}'],
                   max_size=None)


def printed(log):
    return [line for line in log().splitlines() if line.startswith('tf_view: ')]


def assert_told(log, clock, kinds, count):
    """Assert that there is a line for each kind, and a second later the counts of all."""
    assert len(printed(log)) == kinds
    clock.now += 1.0
    until(lambda: told(printed(log)) == count)
    assert len(printed(log)) <= 2 * kinds


def test_bytes_that_are_no_request(serving, clock, log):
    rng = random.Random(1)
    for number in range(COUNT):
        send(serving, (b'POST /%d HTTP/1.1\r\n\r\n' % number, rng.randbytes(number + 1)
                       + b'\r\n\r\n')[number % 2])
    until(lambda: omitted(log_of(serving)) == COUNT - 1)
    assert 'Traceback' not in log() and 'from 127.0.0.1: ' in log()
    assert_told(log, clock, 1, COUNT)


def test_bytes_of_a_client_are_escaped(serving, clock, log):
    send(serving, b'GET /\x1b]0;owned\x07\x1b[31m X HTTP/9.9\r\n\r\n')
    until(lambda: printed(log))
    assert r'\x1b]0;owned\x07' in log() and '\x1b' not in log()


def test_errors_whose_texts_have_addresses_are_one_kind(clock):
    lines = []
    limited = LimitedLog(lines.append)
    logger = RequestLogger(limited)
    for number in range(COUNT):
        logger.handle_error(None, {'message': f'Exception in callback <f at 0x{number:x}>',
                                   'exception': ValueError('no')})
    assert lines == ['Exception in callback <f at 0x0>: ValueError: no']
    clock.now += 1.0
    limited.write_counts()
    assert len(lines) == 2 and told(lines) == COUNT


def test_connections_that_send_nothing_are_not_worth_a_line(serving, clock, log):
    """Browsers make such connections in advance."""
    for _ in range(10):
        send(serving, b'')
    send(serving, b'rubbish')
    until(lambda: printed(log))
    assert len(printed(log)) == 1 and not omitted(log_of(serving))


def test_messages_that_no_page_sends(serving, clock, log):
    async def send_rubbish():
        for number in range(20):
            async with open_page(serving) as page:
                await page.send(b'\xc1' + os.urandom(number))
                try:
                    while True:
                        await page.recv()
                except ConnectionClosed:
                    pass

    asyncio.run(asyncio.wait_for(send_rubbish(), PATIENCE_S))
    until(lambda: omitted(log_of(serving)) == 19)
    assert 'connection handler failed, from 127.0.0.1: ' in log() and 'Traceback' not in log()
    assert_told(log, clock, 1, 20)


def test_values_that_no_control_has(serving, clock, log):
    async def set_values():
        async with open_page(serving) as page:
            reading = asyncio.create_task(read_all(page))
            await page.send(msgspec.msgpack.encode(CAMERA))
            await asyncio.to_thread(until, lambda: pages_of(serving))
            (client,) = serving._server.get_clients().values()
            slider = next(uuid for uuid, handle in client.gui._gui_input_handle_from_uuid.items()
                          if type(handle).__name__ == 'GuiSliderHandle')
            for number in range(COUNT):
                update = {'value': f'text {number}'} if number % 2 else {'nothing': number}
                await page.send(msgspec.msgpack.encode(
                    {'type': 'GuiUpdateMessage', 'uuid': slider, 'updates': update}))
            await asyncio.to_thread(until, lambda: omitted(log_of(serving)) == COUNT - 1)
            reading.cancel()

    async def read_all(page):
        async for _ in page:
            pass

    asyncio.run(asyncio.wait_for(set_values(), PATIENCE_S))
    assert 'Task exception was never retrieved' in log() and 'Traceback' not in log()
    assert_told(log, clock, 1, COUNT)


def test_actions_that_fail_do_not_stop_the_page(serving, clock, log):
    def fail():
        raise ValueError('no such frame')

    done = []

    async def press():
        async with open_page(serving) as page:
            await page.send(msgspec.msgpack.encode(CAMERA))
            await asyncio.to_thread(until, lambda: pages_of(serving))
            (shown,) = pages_of(serving)
            for action in (*COUNT * [fail], lambda: done.append(True)):
                shown._apply(action)

    asyncio.run(asyncio.wait_for(press(), PATIENCE_S))
    assert done
    assert log().count('ValueError: no such frame') == 1
    assert_told(log, clock, 1, COUNT)


def test_page_is_drawn_again_after_an_error_and_given_up_after_many(
        serving, clock, log, monkeypatch):
    drawn = []

    def tick(page, seconds):
        drawn.append(len(drawn))
        if drawn[-1] >= 80 or drawn[-1] % 2 == 0:
            raise RuntimeError('deque mutated during iteration')

    async def stay():
        async with open_page(serving) as page:
            await page.send(msgspec.msgpack.encode(CAMERA))
            await asyncio.to_thread(until, lambda: drawn and not pages_of(serving))

    monkeypatch.setattr(Page, 'tick', tick)
    monkeypatch.setattr(serving_module, 'RATE_HZ', 1000.0)
    asyncio.run(asyncio.wait_for(stay(), PATIENCE_S))
    assert len(drawn) == 80 + 30
    assert log().count('RuntimeError: deque mutated') == 1
    clock.now += 1.0
    until(lambda: 'tf_view: 40 more like this: a page failed with RuntimeError' in log())
