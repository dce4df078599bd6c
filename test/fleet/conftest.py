# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A router, robots and listeners for each file's tests; all tests skip without Zenoh."""

from importlib.util import find_spec
import itertools

from hand_clock import clock_of_logs
import pytest

collect_ignore_glob = [] if find_spec('zenoh') else ['test_*.py']
if find_spec('zenoh'):
    from fleet_helpers import router_here, session_at
    from tf_tree_py.fleet import connection, FleetListener, RobotPublisher

numbers = itertools.count()


@pytest.fixture
def impatient(monkeypatch):
    """Let an attempt to connect end soon, where the router is on this machine or nowhere."""
    monkeypatch.setattr(connection, 'ATTEMPT_S', 0.2)


@pytest.fixture
def clock(monkeypatch):
    return clock_of_logs(monkeypatch)


@pytest.fixture(scope='module')
def router():
    with router_here() as endpoint:
        yield endpoint


@pytest.fixture(scope='module')
def session(router):
    with session_at(router) as session:
        yield session


@pytest.fixture
def hall():
    """Return a prefix of keys that is unique to the test."""
    return f'hall{next(numbers)}'


@pytest.fixture
def listen(router, hall):
    """Return a function that creates listeners of this hall, closed at the end of the test."""
    made = []

    def listen(robots='*', **options):
        made.append(FleetListener(router, robots, **{'key_prefix': hall, **options}))
        return made[-1]

    yield listen
    for listener in made:
        listener.close()


@pytest.fixture
def robot(session, hall):
    """Return a function that creates robots of this hall, closed at the end of the test."""
    made = []

    def robot(name, **options):
        made.append(RobotPublisher(session, name, key_prefix=hall, **options))
        return made[-1]

    yield robot
    for one in made:
        one.close()
