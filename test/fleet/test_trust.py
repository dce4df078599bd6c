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

"""A robot says what it likes of its own frames, and nothing of others; no bytes do any harm."""

import itertools
import logging

from effort import examples
from fleet_helpers import message, PATIENCE_S, SECOND, until, x_of
from hypothesis import given, HealthCheck, strategies as st
import pytest
from tf_tree_py.core import Kind
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write


def test_a_robot_cannot_hang_what_is_shared_elsewhere_nor_touch_others(listen, robot):
    buffer = (listener := listen()).buffer
    robot('robot8').send(message(('map', 'base', 8)))
    assert x_of(buffer, 'map', 'robot8/base') == 8.0
    evil = robot('robot7')
    for child in ('map', '/map', 'robot8/base', '/robot8/base'):
        evil.send(message(('trap', child, 1), ('map', 'base', 7)))
    until(lambda: len(listener.robots()) == 2 and listener.robots()[0].transforms == 6)
    assert [(one.name, one.refused) for one in listener.robots()] == [('robot7', 2), ('robot8', 0)]
    assert buffer.statistics().incidents[Kind.NOT_ITS_OWN] == 2
    assert x_of(buffer, 'map', 'robot8/base') == 8.0
    assert {info.child: info.parent for info in buffer.edges()} == {
        'robot8/base': 'map', 'robot7/base': 'map', 'robot7/robot8/base': 'robot7/trap'}


def test_frames_that_are_below_their_robot_already_stay(listen, robot):
    listener = listen()
    robot('robot7').send(message(('map', 'robot7/base', 7), ('robot7/base', 'fork', 1)))
    assert x_of(listener.buffer, 'map', 'robot7/fork') == 8.0
    assert listener.buffer.lookup('map', 'robot7/base').x == 7.0


def test_a_robot_among_whose_frames_another_would_get_is_not_heard(listen, robot, caplog):
    listener = listen('**')
    robot('robot7').send(message(('map', 'base', 7)))
    assert x_of(listener.buffer, 'map', 'robot7/base') == 7.0
    robot('robot7/arm').send(message(('map', 'base', 8)))
    until(lambda: 'robot7/arm' in caplog.text)
    assert 'would get among those of another' in caplog.text
    assert [one.name for one in listener.robots()] == ['robot7']


def test_refusals_are_logged_and_no_more_than_a_person_reads(listen, robot, caplog):
    listener = listen()
    evil = robot('robot7')
    for _ in range(50):
        evil.send(message(('trap', 'map', 1)))
    until(lambda: listener.robots() and listener.robots()[0].refused == 50)
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert 'shared by all robots' in caplog.text and "from 'robot7'" in caplog.text


# --- bytes

names = st.text(st.characters(exclude_categories=['Cs']), max_size=8) | st.sampled_from(
    ['map', '/map', 'base', 'robot8/base'])
poses = st.tuples(*[st.floats()] * 7)
stamps = st.integers(-2**31 * SECOND, 2**31 * SECOND - 1)
sound = st.lists(st.builds(Sample, names, names, stamps, poses), max_size=4).map(write)
cut = st.builds(lambda data, at: data[:at], sound, st.integers(0, 200))
flipped = st.builds(lambda data, at, byte: data[:at] + bytes([byte]) + data[at + 1:],
                    sound, st.integers(0, 200), st.integers(0, 255))


@given(st.lists(st.binary(max_size=200) | sound | cut | flipped, max_size=30))
@examples(4, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_bytes_harm_others_or_end_the_listening(pair, payloads):
    listener, evil, good, turns = pair
    for payload in payloads:
        evil.send(payload)
    # It goes the same way, behind them.
    turn = next(turns)
    good.send(message(('map', 'base', turn), stamp=turn * SECOND))
    assert listener.buffer.lookup_within(
        PATIENCE_S, 'map', 'good/base', turn * SECOND).x == turn
    for edge in listener.buffer.edges():
        assert edge.child == 'good/base' or edge.child.startswith('evil/')
        assert edge.parent == 'map' or edge.parent.startswith('evil/')
    assert listener.robots()[1].refused == 0


@pytest.fixture
def pair(listen, robot):
    """Return a listener, one who sends anything, one who sends well, and numbers."""
    return listen(), robot('evil'), robot('good'), itertools.count(1)
