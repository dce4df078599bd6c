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

"""Mutual TLS, access control, users with passwords: by the files that docs/fleet.md explains."""

from pathlib import Path

from fleet_helpers import free_port, message, session_at, Visits, x_of
import pytest
from tf_tree_py.fleet import configuration, FleetError, FleetListener, open_session, RobotPublisher
import zenoh

trustme = pytest.importorskip('trustme')
EXAMPLES = Path(__file__).parents[2] / 'config'
NAMES = ('router', 'desk', 'robot7', 'robot8')


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with certificates of the fleet, and of a stranger."""
    folder = tmp_path_factory.mktemp('fleet') / 'certificates'
    folder.mkdir()
    ours, theirs = trustme.CA(), trustme.CA()
    ours.cert_pem.write_to_path(folder / 'ca.pem')
    for name, authority in {**dict.fromkeys(NAMES, ours), 'stranger': theirs}.items():
        made = authority.issue_cert('localhost', '127.0.0.1', common_name=name)
        made.private_key_pem.write_to_path(folder / f'{name}.key')
        made.cert_chain_pems[0].write_to_path(folder / f'{name}.pem')
    return folder.parent


def written(folder, example, name, changes):
    """Write an example's file with other names and places; return its path."""
    text = (EXAMPLES / f'{example}.json5').read_text()
    for old, new in {'certificates/': f'{folder}/certificates/', **changes}.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / f'{name}.json5'
    path.write_text(text)
    return path


def client(folder, name, more=''):
    return written(folder, 'fleet_client', f'{name}{len(more)}',
                   {'desk.': f'{name}.', '    link: {': f'    {more} link: {{'})


def user(name, password):
    return f'auth: {{ usrpwd: {{ user: "{name}", password: "{password}" }} }},'


@pytest.fixture
def router(folder):
    """Return what runs a router with the example's file; yield nothing else."""
    sessions = []

    def router(changes=None):
        endpoint = f'tls/127.0.0.1:{free_port()}'
        path = written(folder, 'fleet_router', 'router',
                       {'tls/0.0.0.0:7447': endpoint, **(changes or {})})
        sessions.append(zenoh.open(zenoh.Config.from_file(path)))
        return endpoint

    yield router
    for session in sessions:
        session.close()


def test_each_robot_speaks_below_its_own_name_and_the_desk_hears(folder, router):
    endpoint, visits = router(), Visits()
    with FleetListener(endpoint, config=client(folder, 'desk'), on_robot=visits) as listener, \
            session_at(endpoint, client(folder, 'robot8')) as evil, \
            session_at(endpoint, client(folder, 'robot7')) as own, \
            session_at(endpoint, client(folder, 'desk')) as desk:
        for bad in (evil, desk):
            RobotPublisher(bad, 'robot7').send_static(message(('base', 'fork', 666)))
            RobotPublisher(bad, 'robot8').send_static(message(('base', 'fork', 666)))
        with RobotPublisher(own, 'robot7') as robot:
            robot.send_static(message(('base', 'fork', 7)))
            assert x_of(listener.buffer, 'robot7/base', 'robot7/fork') == 7.0
            assert visits.wait() == ('robot7', True)
            robot.send(message(('map', 'base', 1)))
            assert x_of(listener.buffer, 'map', 'robot7/fork') == 8.0
            assert {one.name: one.transforms for one in listener.robots()} == {'robot7': 2}
        assert visits.wait() == ('robot7', False)


def test_who_has_no_certificate_of_the_fleet_is_kept_out(folder, router):
    endpoint = router()
    nothing = folder / 'nothing.json5'
    nothing.write_text('{}')
    for stranger, there in [(nothing, endpoint), (client(folder, 'stranger'), endpoint),
                            (nothing, endpoint.replace('tls', 'tcp'))]:
        with pytest.raises(FleetError, match='Unable to connect'):
            open_session(configuration(there, stranger), timeout_s=0.5)


def test_users_have_passwords_where_the_router_wants_them(folder, router):
    (folder / 'users.txt').write_text('robot7:secret\n')
    endpoint = router({'    link: {': f"""auth: {{ usrpwd: {{
        user: "router", password: "x", dictionary_file: "{folder}/users.txt" }} }}, link: {{"""})
    with session_at(endpoint, client(folder, 'robot7', user('robot7', 'secret'))):
        pass
    for wrong in (user('robot7', 'guessed'), user('desk', 'secret'), ''):
        with pytest.raises(FleetError, match='Unable to connect'):
            open_session(configuration(endpoint, client(folder, 'robot7', wrong)), timeout_s=0.5)
