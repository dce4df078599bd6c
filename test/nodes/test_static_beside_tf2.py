# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Our static_transform_publisher and tf2's send equal messages, except as in deviations.md."""

import math
import os
from pathlib import Path
import signal
import subprocess

from programs import completed, executable, PATIENCE_S
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from standin import standin_env
from tf2_msgs.msg import TFMessage
from tf_tree_py.ros.topics.qos import static_listener_qos

FRAMES = ['--frame-id', 'map', '--child-frame-id', 'b']


def of_tf2(arguments):
    """Return the command line and the environment of tf2's program."""
    env = standin_env()
    places = (Path(folder, 'lib', 'tf2_ros', 'static_transform_publisher')
              for folder in env['AMENT_PREFIX_PATH'].split(os.pathsep))
    return [next(str(place) for place in places if place.exists()), *arguments], env


def of_ours(arguments):
    return executable('static_transform_publisher', *arguments), dict(os.environ)


# One node for all programs, which leave in order (docs/ending.md).
@pytest.fixture(scope='module')
def heard_of():
    """Return a function that runs a program, and returns the transform that it publishes."""
    context = Context()
    rclpy.init(context=context, args=[])
    node = Node('hearing', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def heard_of(command, env):
        heard = Future()
        subscription = node.create_subscription(
            TFMessage, '/tf_static',
            lambda message: heard.done() or heard.set_result(message.transforms[0]),
            static_listener_qos())
        with subprocess.Popen(command, env=env, stdin=subprocess.DEVNULL,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
            executor.spin_until_future_complete(heard, PATIENCE_S)
            program.send_signal(signal.SIGINT)
        node.destroy_subscription(subscription)
        return heard.result()

    yield heard_of
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


def refusal(command, env):
    """Return the exit status and the output of a program that ends by itself."""
    done = completed(*command, env=env, stdin=subprocess.DEVNULL)
    return done.returncode, done.stderr


def numbers(transform):
    t, q = transform.transform.translation, transform.transform.rotation
    return (t.x, t.y, t.z, q.x, q.y, q.z, q.w)


def named(transform):
    return transform.header.frame_id, transform.child_frame_id


@pytest.mark.parametrize('arguments', [
    FRAMES,
    [*FRAMES, '--x', '1.5', '--y', '-2e-3', '--roll', '0.1', '--pitch', '-0.2', '--yaw', '3.0'],
    [*FRAMES, '--yaw', '-3.0'],
    # The sign is as given.
    [*FRAMES, '--qx', '0.6', '--qw', '-0.8'],
    ['1', '2', '3', '0.3', '-0.2', '0.1', 'map', 'b'],
    ['1', '2', '3', '0', '0', '-0.6', '-0.8', 'map', 'b'],
], ids=' '.join)
def test_same_arguments_publish_the_same(heard_of, arguments):
    theirs, ours = heard_of(*of_tf2(arguments)), heard_of(*of_ours(arguments))
    assert named(ours) == named(theirs) == ('map', 'b')
    assert numbers(ours) == pytest.approx(numbers(theirs), abs=1e-15)


# --- where ours is safer: the behaviour of tf2 in the list of deviations


def test_quaternion_is_normalised_and_slashes_are_stripped(heard_of):
    arguments = ['--frame-id', '/map', '--child-frame-id', '/b', '--qx', '3', '--qw', '4']
    theirs, ours = heard_of(*of_tf2(arguments)), heard_of(*of_ours(arguments))
    assert (named(theirs), named(ours)) == (('/map', '/b'), ('map', 'b'))
    assert numbers(theirs) == (0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 4.0)
    assert numbers(ours) == pytest.approx((0.0, 0.0, 0.0, 0.6, 0.0, 0.0, 0.8))


@pytest.mark.parametrize(('arguments', 'published', 'sentence'), [
    (['--qw', '0'], (0.0,) * 7, 'the quaternion is all zero'),
    (['--x', 'nan'], (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), 'is not a finite number'),
    (['--x', '1,5'], (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "'1,5' is not a finite number"),
], ids=['all zero', 'nan', 'comma'])
def test_what_is_no_transform_is_not_published(heard_of, arguments, published, sentence):
    theirs = heard_of(*of_tf2([*FRAMES, *arguments]))
    assert numbers(theirs) == pytest.approx(published, nan_ok=True)
    status, told = refusal(*of_ours([*FRAMES, *arguments]))
    assert status == 2
    assert sentence in told


def test_frame_above_itself_is_told_and_does_not_abort():
    arguments = ['--frame-id', 'map', '--child-frame-id', 'map']
    status, told = refusal(*of_tf2(arguments))
    assert status < 0
    assert 'terminate called' in told
    status, told = refusal(*of_ours(arguments))
    assert status == 2
    assert "both 'map'" in told
