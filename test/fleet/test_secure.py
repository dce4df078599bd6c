# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Mutual TLS, access control, users with passwords: with the files that docs/fleet.md explains."""

from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timezone
from pathlib import Path

from conditions import until
from fleet_helpers import (
    AT_ONCE,
    free_port,
    kept,
    message,
    rmw_token,
    router_here,
    session_at,
    Visits,
    x_of,
)
import pytest
from tf_tree_py.fleet import configuration, FleetError, FleetListener, open_session, RobotPublisher
from tf_tree_py.fleet.keys import key_of, rmw_key_of, Topic
from tf_tree_py.fleet.session import try_session
from tf_tree_py.tools.tf_doctor import main as tf_doctor
import zenoh

trustme = pytest.importorskip('trustme')
EXAMPLES = Path(__file__).parents[2] / 'config'
NAMES = ('router', 'desk', 'robot7', 'robot8', 'forklift1', 'forklift2')
LONG_AGO = datetime(2020, 1, 1, tzinfo=timezone.utc)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with certificates of the fleet, and of an unknown client."""
    folder = tmp_path_factory.mktemp('fleet') / 'certificates'
    folder.mkdir()
    ours, theirs = trustme.CA(), trustme.CA()
    ours.cert_pem.write_to_path(folder / 'ca.pem')
    for name, authority in {**dict.fromkeys(NAMES, ours), 'stranger': theirs}.items():
        made = authority.issue_cert('localhost', '127.0.0.1', common_name=name)
        made.private_key_pem.write_to_path(folder / f'{name}.key')
        made.cert_chain_pems[0].write_to_path(folder / f'{name}.pem')
    old = ours.issue_cert('localhost', '127.0.0.1', common_name='old', not_after=LONG_AGO)
    old.private_key_pem.write_to_path(folder / 'old.key')
    old.cert_chain_pems[0].write_to_path(folder / 'old.pem')
    theirs.cert_pem.write_to_path(folder / 'theirs.pem')
    return folder.parent


def written(folder, example, name, changes):
    """Write an example's file with other names and addresses; return its path."""
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
    """Yield a function that runs a router with the example's file."""
    sessions = []

    def router(changes=None):
        endpoint = f'tls/127.0.0.1:{free_port()}'
        path = written(folder, 'fleet_router', 'router',
                       {'tls/0.0.0.0:7447': endpoint, **(changes or {})})
        config = zenoh.Config.from_file(path)
        for name, value in AT_ONCE.items():
            config.insert_json5(f'scouting/{name}', str(value))
        sessions.append(zenoh.open(config))
        return endpoint

    yield router
    for session in sessions:
        session.close()


@pytest.fixture
def guarded(folder, router):
    """Return the address of a router that wants the password of robot7."""
    (folder / 'users.txt').write_text('robot7:secret\n')
    return router({'    link: {': f"""auth: {{ usrpwd: {{
        user: "router", password: "x", dictionary_file: "{folder}/users.txt" }} }}, link: {{"""})


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


def bridge_token(zid, robot, topic):
    return f'@/{zid}/@ros2_lv/MP/{robot}§{topic}/tf2_msgs§msg§TFMessage/:1:1:0,1'


@pytest.mark.parametrize(('own', 'key_of', 'token_of'), [
    ('forklift1', rmw_key_of, rmw_token), ('forklift2', key_of, bridge_token)])
def test_robots_of_others_speak_below_their_own_names_too(folder, router, own, key_of, token_of):
    endpoint, visits = router(), Visits()
    with session_at(endpoint, client(folder, own)) as session:
        # The last one is permitted, so the one before would have arrived.
        held = [(kept(session, key_of(Topic(robot, True)), message(('base', 'fork', 2))),
                 session.liveliness().declare_token(token_of(session.zid(), robot, 'tf_static')))
                for robot in ('robot7', own)]
        with FleetListener(endpoint, config=client(folder, 'desk'), on_robot=visits) as listener:
            assert x_of(listener.buffer, f'{own}/base', f'{own}/fork') == 2.0
            assert visits.wait() == (own, True)
            session.put(key_of(Topic('robot7', False)), message(('map', 'base', 666)))
            until(lambda: session.put(key_of(Topic(own, False)), message(('map', 'base', 1)))
                  or 'map' in listener.buffer.frames())
            assert [one.name for one in listener.robots()] == [own]
        del held


def test_cache_of_a_robot_cannot_answer_for_another(folder, router):
    endpoint = router()
    with session_at(endpoint, client(folder, 'robot7')) as own, \
            session_at(endpoint, client(folder, 'forklift2')) as other:
        def answer(query):
            query.reply('robot7/tf_static', message(('base', 'fork', 666)))
            query.reply('forklift2/tf_static', message(('base', 'fork', 2)))

        evil = other.declare_queryable('forklift2/tf_static/@adv/pub/**', answer)
        with FleetListener(endpoint, config=client(folder, 'desk')) as listener:
            good = kept(own, 'robot7/tf_static', message(('base', 'fork', 7)))
            assert x_of(listener.buffer, 'robot7/base', 'robot7/fork') == 7.0
            token = other.liveliness().declare_token('forklift2/tf_static/@adv/pub/1/2/_')
            x_of(listener.buffer, 'forklift2/base', 'forklift2/fork')
            assert listener.buffer.lookup('robot7/base', 'robot7/fork').x == 7.0
        for declared in (good, token, evil):
            declared.undeclare()


def test_who_has_no_certificate_of_the_fleet_is_kept_out(folder, router):
    endpoint = router()
    nothing = folder / 'nothing.json5'
    nothing.write_text('{}')
    assert_refused([(endpoint, nothing), (endpoint, client(folder, 'stranger')),
                    (endpoint.replace('tls', 'tcp'), nothing)])


def test_users_have_passwords_where_the_router_wants_them(folder, guarded):
    with session_at(guarded, client(folder, 'robot7', user('robot7', 'secret'))):
        pass
    assert_refused([(guarded, client(folder, 'robot7', wrong)) for wrong in (
        user('robot7', 'guessed'), user('desk', 'secret'), '')])


def assert_refused(attempts):
    """Assert that no session starts with any of these addresses and files, tried together."""
    def attempt(there, config):
        with pytest.raises(FleetError, match='Unable to connect'):
            try_session(configuration(there, config), timeout_s=0.5)

    with ThreadPoolExecutor() as pool:
        assert list(pool.map(attempt, *zip(*attempts, strict=True))) == [None] * len(attempts)


# --- the reasons of refusals

def reason(endpoint, config=None):
    with pytest.raises(FleetError) as raised:
        open_session(configuration(endpoint, config), timeout_s=0.05)
    assert '\n' not in str(raised.value)
    return str(raised.value)


def desk(folder, name, changes):
    return written(folder, 'fleet_client', name, changes)


@pytest.mark.parametrize(('changes', 'sentence'), [
    ({'desk.pem': 'none.pem'}, 'none.pem cannot be read (connect_certificate): No such file'),
    ({'ca.pem': 'none.pem'}, 'none.pem cannot be read (root_ca_certificate): No such file'),
    ({'desk.key': 'robot7.key'}, 'is not the private key of the certificate'),
    ({'desk.key': 'desk.pem'}, 'are not a certificate and its private key in PEM format'),
    ({'ca.pem': 'desk.key'}, 'is not the certificate of an authority in PEM format'),
    ({'desk.': 'old.'}, 'certificate has expired, by the clock of this machine (20'),
    ({'desk.': 'stranger.'}, 'stranger.pem is refused: it is not signed by the authority in'),
    ({'ca.pem': 'theirs.pem', 'desk.': 'stranger.'}, 'refuses the certificate of the '
     'router at 127.0.0.1: it is not signed by the authority in'),
    ({'enable_mtls: true,': '', 'connect_certificate:': '//', 'connect_private_key:': '//'},
     'requires a client certificate: set transport/link/tls'),
])
def test_why_a_certificate_is_refused_is_explained(folder, router, changes, sentence):
    assert sentence in reason(router(), desk(folder, 'refused', changes))


def test_router_that_expects_another_authority_is_explained(folder, router):
    endpoint = router({'ca.pem': 'theirs.pem'})
    assert "refuses this machine's certificate: unknown ca" in reason(
        endpoint, client(folder, 'desk'))


def test_other_reasons_are_explained(folder, router):
    with router_here() as endpoint:
        assert 'does not use TLS' in reason(endpoint.replace('tcp', 'tls'), client(folder, 'desk'))
    assert 'cannot be reached: Connection refused' in reason(endpoint)
    endpoint = router()
    assert 'require tls/ instead of tcp/' in reason(endpoint.replace('tls', 'tcp'))
    assert 'no address is known' in reason('tcp/no-such-host.invalid:7447')


def test_password_that_is_wrong_is_a_possible_reason(folder, guarded):
    assert 'may require a user and a password' in reason(
        guarded, client(folder, 'robot7', user('robot7', 'guessed')))


def test_listener_and_tool_say_why(impatient, folder, router, caplog, capsys):
    config = desk(folder, 'expired', {'desk.': 'old.'})
    endpoint = router()
    with FleetListener(endpoint, config=config) as listener:
        until(lambda: 'yet, retrying' in caplog.text)
        assert 'certificate has expired' in caplog.text
        assert 'certificate has expired' in listener.why_not_connected()
    tf_doctor(['tf_doctor', '--fleet', endpoint, '--fleet-config', str(config),
               '--seconds', '0.1'])
    shown = capsys.readouterr()
    assert 'certificate has expired' in ' '.join((shown.out + shown.err).split())
