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

"""A router, robots and listeners for each file's tests; nothing runs without Zenoh."""

from importlib.util import find_spec
import itertools

import pytest

collect_ignore_glob = [] if find_spec('zenoh') else ['test_*.py']
if find_spec('zenoh'):
    from fleet_helpers import router_here, session_at
    from tf_tree_py.fleet import FleetListener, RobotPublisher

numbers = itertools.count()


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
    """Return a prefix of keys that no other test has."""
    return f'hall{next(numbers)}'


@pytest.fixture
def listen(router, hall):
    """Return what makes listeners of this hall, which end with the test."""
    made = []

    def listen(robots='*', **options):
        made.append(FleetListener(router, robots, **{'key_prefix': hall, **options}))
        return made[-1]

    yield listen
    for listener in made:
        listener.close()


@pytest.fixture
def robot(session, hall):
    """Return what makes robots of this hall, which go with the test."""
    made = []

    def robot(name, **options):
        made.append(RobotPublisher(session, name, key_prefix=hall, **options))
        return made[-1]

    yield robot
    for one in made:
        one.close()
