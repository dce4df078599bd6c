# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limit for the latest in unchanged programs, by TF_TREE_MAX_AGE=0.5."""

import textwrap

from dropin_helpers import LISTENS, run
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import lasting, PATIENCE, transform, until_waiting
from tf_tree_py import StaleException, UNLIMITED
from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.listener import TransformListener

VARIABLE = 'TF_TREE_MAX_AGE'


@pytest.fixture
def buffer(monkeypatch):
    monkeypatch.setenv(VARIABLE, '100')
    return Buffer()


def ago(buffer, seconds):
    return buffer.now() / 1e9 - seconds


def test_the_variable_is_the_default_of_buffers(buffer):
    assert buffer.max_age == lasting(100.0).nanoseconds
    buffer.set_transform(transform('map', 'base', ago(buffer, 200.0)), 'me')
    with pytest.raises(StaleException, match="edge map -> base, last published by 'me'"):
        buffer.lookup_transform('map', 'base', Time())
    assert not buffer.can_transform('map', 'base', Time())
    found, why = buffer.can_transform('map', 'base', Time(), return_debug_tuple=True)
    assert (found, 'max_age is 100.000 s' in why) == (0, True)
    buffer.set_transform(transform('map', 'base', ago(buffer, 50.0)), 'me')
    assert buffer.lookup_transform('map', 'base', Time())
    assert buffer.can_transform('map', 'base', Time(), return_debug_tuple=True) == (1, '')


def test_what_a_program_gives_comes_first(buffer):
    assert Buffer(max_age=None).max_age is None
    assert Buffer(max_age=lasting(1.0)).max_age == lasting(1.0).nanoseconds
    buffer.set_transform(transform('map', 'base', ago(buffer, 200.0)), 'me')
    for each in buffer, Buffer(max_age=None):
        each.set_transform(transform('map', 'base', ago(buffer, 200.0)), 'me')
        for limit, can in (UNLIMITED, True), (lasting(1.0), False), (lasting(500.0), True):
            assert each.can_transform('map', 'base', Time(), max_age=limit) is can
            found, why = each.can_transform('map', 'base', Time(), Duration(), True, max_age=limit)
            assert (found, 'max_age is 1.000 s' in why) == (int(can), not can)


def test_without_it_there_is_no_limit(monkeypatch):
    for value in None, '':
        monkeypatch.delenv(VARIABLE, raising=False) if value is None else monkeypatch.setenv(
            VARIABLE, value)
        buffer = Buffer()
        assert buffer.max_age is None
        buffer.set_transform(transform('map', 'base', 1.0), 'me')
        assert buffer.can_transform('map', 'base', Time())


@pytest.mark.parametrize('wrong', ['0', '1e-12', '-1', 'nan', 'inf', '1e10', 'half a second'])
def test_a_wrong_value_is_an_error_that_names_the_variable(monkeypatch, wrong):
    monkeypatch.setenv(VARIABLE, wrong)
    with pytest.raises(ValueError, match=f'{VARIABLE} .*such as 0.5, and not {wrong!r}'):
        Buffer()


def test_what_has_arrived_but_was_not_inserted_is_not_missed(buffer, node, talker, executor):
    """In a callback, tf2 has read what was sent before."""
    listener = TransformListener(buffer, node)
    executor.add_node(node)
    talker.move(transform('map', 'base', ago(buffer, 200.0)))
    buffer.lookup_transform('map', 'base', Time(), PATIENCE, max_age=UNLIMITED)
    talker.move(transform('map', 'base', ago(buffer, 10.0)))
    assert buffer.lookup_transform('map', 'base', Time(), PATIENCE)
    assert buffer.lookup_transform_newest('map', 'base', max_age=lasting(90.0)).stamps
    listener.unregister()


def test_a_wait_ends_with_a_fresh_one(buffer, pool):
    buffer.set_transform(transform('map', 'base', ago(buffer, 200.0)), 'me')
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', Time(), PATIENCE)
    until_waiting(buffer)
    fresh = transform('map', 'base', ago(buffer, 10.0))
    buffer.set_transform(fresh, 'me')
    assert asked.result() == fresh


PROGRAM = LISTENS + """
    old = tf2_ros.TransformStamped(child_frame_id='odom')
    old.header.frame_id, old.header.stamp.sec = 'map', 1_000_000_000
    buffer.set_transform(old, 'me')
    try:
        buffer.lookup_transform('map', 'odom', Time())
    except tf2_ros.ExtrapolationException as error:
        print(error)
    print(buffer.can_transform('map', 'odom', Time(seconds=1_000_000_000)))
    rclpy.shutdown()
"""


def test_an_unchanged_program_takes_it(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, '0.5')
    program = tmp_path / 'program.py'
    program.write_text(textwrap.dedent(PROGRAM))
    done = run('-m', 'tf_tree_py.dropin', '--force', program)
    assert done.returncode == 0, done.stderr
    assert "the edge map -> odom, last published by 'me', is " in done.stdout
    assert 's old, and max_age is 500 ms, when looking up' in done.stdout
    assert done.stdout.splitlines()[-1] == 'True'
