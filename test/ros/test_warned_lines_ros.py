# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Warnings in a node are at the line of the program, also in its callbacks and in tf2's names."""

from functools import partial

import numpy as np
from programs import PATIENCE_S
import pytest
from rclpy.duration import Duration
from ros_helpers import move
import tf_tree_py as tf
from tf_tree_py.core import Pose, Sample, TransformWarning
from tf_tree_py.dropin import buffer as dropin
from warned_lines import assert_warns_at_its_line

SHORT = Duration(nanoseconds=10)
NAN = Pose(float('nan'))
CURVE = tf.ConstantTwist(0, 10**9, Pose(), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))

CALLS = {
    'insert': lambda made: made.insert('map', 'base', 1, NAN),
    'covariance': lambda made: made.insert('map', 'base', 1, NAN, covariance=np.eye(6)),
    'insert_many': lambda made: made.insert_many([Sample('map', 'base', 1, NAN)]),
    'insert_track': lambda made: made.insert_track('map', 'base', [1], [NAN]),
    'insert_curve': lambda made: made.insert_curve('base', 'base', CURVE),
    'lookup_many': lambda made: made.lookup_many('map', 'base', [1, 2], outside='mask'),
    'trajectory': lambda made: tf.trajectory(made, 'map', 'base', [1, 2]),
}
BUFFERS = {'Buffer': tf.Buffer, 'with an audit': lambda: tf.Buffer(audit=True),
           'drop-in': dropin.Buffer, "tf2_py's": dropin.BufferCore}


@pytest.mark.parametrize('make', BUFFERS.values(), ids=BUFFERS)
def test_calls_of_a_buffer_are_warned_of_at_their_lines(make):
    for call in CALLS.values():
        buffer = make()
        move(buffer, 1.0)
        move(buffer, 5.0)
        assert_warns_at_its_line(call, buffer)


@pytest.mark.parametrize('call', [
    lambda node: tf.Buffer(SHORT),
    lambda node: tf.Buffer(cache_time=SHORT, node=node),
    lambda node: tf.shared_buffer(node, cache_time=SHORT),
    lambda node: dropin.Buffer(SHORT),
    lambda node: dropin.BufferCore(SHORT)])
def test_short_window_is_warned_of_where_it_is_given(node, call):
    assert_warns_at_its_line(call, node)


def test_callback_of_a_program_is_the_caller(node, executor):
    called = []

    def on_timer():
        called.append(assert_warns_at_its_line(CALLS['insert'], tf.Buffer()))

    node.create_timer(0.001, on_timer)
    executor.add_node(node)
    while not called:
        executor.spin_once(PATIENCE_S)


def test_method_that_rclpy_calls_is_warned_of_where_the_program_spins(node, executor):
    node.create_timer(0.001, partial(tf.Buffer().insert, 'map', 'base', 1, NAN))
    executor.add_node(node)
    with pytest.warns(TransformWarning) as caught:
        while not caught:
            executor.spin_once(PATIENCE_S)
    assert [one.filename for one in caught] == [__file__]
