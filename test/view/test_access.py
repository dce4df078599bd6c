# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Access to the page: requests with the headers that a browser sends for foreign pages."""

import asyncio
from http.client import HTTPConnection

from programs import PATIENCE_S
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.stamp import UNLIMITED

viser = pytest.importorskip('viser', reason="pages need viser: pip install 'tf_tree_py[view]'")

from tf_tree_py.view.serving import Serving  # noqa: E402, I100 - it needs viser
from tf_tree_py.view.subject import Subject  # noqa: E402
from websockets.asyncio.client import connect  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402

HOST, TOKEN = '127.0.0.1', 'a-secret-word'


def served(port, token=''):
    buffer = BufferCore(UNLIMITED)
    buffer.insert('map', 'base', 1, Pose())
    return Serving(Subject(buffer, False, lambda: 0, list, [], None), HOST, port, 'test',
                   token)


@pytest.fixture(scope='module')
def port():
    with served(18910) as serving:
        yield int(serving.url.rpartition(':')[2])


@pytest.fixture(scope='module')
def guarded():
    with served(18930, TOKEN) as serving:
        assert serving.url.endswith(f'/?token={TOKEN}')
        yield int(serving.url.rpartition(':')[2].partition('/')[0])


def got(port, path='/', **headers):
    """Return the status, the cookie and the text of the response to a request."""
    connection = HTTPConnection(HOST, port, timeout=PATIENCE_S)
    try:
        connection.putrequest('GET', path, skip_host='Host' in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.getheader('Set-Cookie'), answer.read().decode()
    finally:
        connection.close()


def opens(port, path='/', origin=None, **headers):
    """Return whether a WebSocket can be opened by a page of an origin."""
    async def opened():
        try:
            async with connect(f'ws://{HOST}:{port}{path}', origin=origin, max_size=None,
                               subprotocols=[f'viser-v{viser.__version__}'],
                               additional_headers=headers):
                return True
        except InvalidStatus as error:
            assert error.response.status_code == 403
            return False

    return asyncio.run(opened())


def test_page_of_this_server_and_programs_without_a_page_connect(port):
    assert got(port)[0] == 200
    assert opens(port)
    assert opens(port, origin=f'http://{HOST}:{port}')
    assert got(port, Host=f'localhost:{port}', Origin=f'http://localhost:{port}')[0] == 200


@pytest.mark.parametrize('origin', [
    'http://evil.example', 'https://127.0.0.1', 'http://127.0.0.1:1', 'http://localhost', 'null',
    'http://127.0.0.1.evil.example', 'file://', 'http://[', ''])
def test_page_of_another_server_does_not_connect(port, origin):
    assert not opens(port, origin=origin)
    status, _, text = got(port, Origin=origin)
    assert status == 403 and 'pages of other servers may not connect' in text


@pytest.mark.parametrize('host', ['evil.example', 'evil.example:8080', 'localhost.evil.example',
                                  '127.0.0.1.evil.example', '[', ''])
def test_foreign_name_of_this_machine_is_not_served(port, host):
    status, _, text = got(port, Host=host, Origin=f'http://{host}')
    assert status == 403
    assert 'not known by that name' in text or 'other servers' in text


@pytest.mark.parametrize('host', ['localhost', 'localhost:9', '192.0.2.7:8080', '[::1]:80'])
def test_addresses_are_served_by_whatever_port_they_were_reached(port, host):
    assert got(port, Host=host, Origin=f'http://{host}')[0] == 200


def test_without_its_token_nothing_is_served(guarded):
    for path in ('/', '/?token=', '/?token=a-secret-wor', '/index.html'):
        status, cookie, text = got(guarded, path)
        assert (status, cookie) == (403, None) and 'open the page with its token' in text
    assert not opens(guarded)
    assert not opens(guarded, Cookie=f'tf_view_{guarded}=a-secret-wor')
    assert not opens(guarded, Cookie='=;;"')


def test_token_opens_the_page_and_its_cookie_the_connection(guarded):
    status, cookie, _ = got(guarded, f'/?token={TOKEN}')
    assert status == 200
    assert 'HttpOnly' in cookie and 'SameSite=Strict' in cookie
    held = cookie.partition(';')[0]
    assert opens(guarded, Cookie=held)
    assert got(guarded, '/', Cookie=f'other=1; {held}', Host='robot7.hall.example')[0] == 200
    assert not opens(guarded, origin='http://evil.example', Cookie=held)
