# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages of five_frame_publisher, compared with its stated motion."""

import bisect
from collections import defaultdict
from contextlib import contextmanager
import math
from pathlib import Path
import threading

from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.geometry import so3
from tf_tree_py.nodes import five_frame_listener, five_frame_publisher
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.five_frame_motion import ARM_PERIOD, DRIFT_PERIOD
from tf_tree_py.nodes.five_frame_publisher import FiveFramePublisher
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_nanoseconds, as_pose
from tf_tree_py.ros.topics.qos import dynamic_qos
import yaml

CONFIG = Path(__file__).parents[2] / 'config' / 'five_frames.yaml'
MOVING = {'odom': 'world', 'base_link': 'odom', 'gripper': 'base_link'}


def publisher(context, **parameters):
    return FiveFramePublisher(context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])


@contextmanager
def recorded(context, count):
    """Return a dictionary that soon contains the messages of each child, at least ``count``."""
    node = Node('recorder', context=context)
    messages, enough = defaultdict(list), threading.Event()

    def record(message):
        for transform in message.transforms:
            messages[transform.child_frame_id].append(transform)
        if len(messages) == len(MOVING) and min(map(len, messages.values())) >= count:
            enough.set()

    node.create_subscription(TFMessage, '/tf', record, dynamic_qos())
    with spun_in_background(node):
        yield messages, enough


@pytest.fixture
def recording(context, buffer):
    """Return the motion, the sent messages, and a buffer with all of them."""
    sending = publisher(context)
    with recorded(context, count=12) as (messages, enough), spun_in_background(sending):
        assert enough.wait(PATIENCE_S)
    for child, sent in messages.items():
        buffer.lookup_within(PATIENCE_S, MOVING[child], child, stamps_of(sent)[-1])
    # Either may have been connected to the publisher slightly before the other.
    oldest = max(edge.oldest for edge in buffer.edges())
    return sending.motion, {
        child: [message for message in sent if as_nanoseconds(message.header.stamp) >= oldest]
        for child, sent in messages.items()}, buffer


def stamps_of(messages):
    return [as_nanoseconds(message.header.stamp) for message in messages]


def as_sent(pose):
    """Return a pose with the sign of its quaternion as in messages."""
    return (*pose[:3], *so3.with_tf2_sign(pose[3:]))


def test_every_transform_is_the_true_one_at_its_stamp(recording):
    motion, messages, buffer = recording
    truth = {'odom': motion.world_T_odom, 'base_link': motion.odom_T_base_link,
             'gripper': motion.base_link_T_gripper}
    for child, parent in MOVING.items():
        assert {message.header.frame_id for message in messages[child]} == {parent}
        for message, stamp in zip(messages[child], stamps_of(messages[child]), strict=True):
            expected = as_sent(truth[child](stamp))
            assert as_pose(message) == expected
            assert buffer.lookup(parent, child, stamp) == pytest.approx(expected, abs=1e-12)
    assert buffer.lookup('base_link', 'camera') == pytest.approx(motion.base_link_T_camera)


def test_lookup_between_stamps_is_as_near_as_interpolation_can_be(recording):
    """
    Derive the bound: on a line between samples h apart, the error is at most h^2/8 |p''|.

    For a rotation, the bound is the same with the angular acceleration, times the lever arm
    of a child frame. All coordinates are sinusoids, A sin(w t), so |p''| <= A w^2.
    """
    motion, messages, buffer = recording
    stamps = {child: stamps_of(sent) for child, sent in messages.items()}
    first, last = max(s[0] for s in stamps.values()), min(s[-1] for s in stamps.values())

    def squared(child, period, stamp):
        after = bisect.bisect_right(stamps[child], stamp)
        gap = stamps[child][after] - stamps[child][after - 1]
        return (gap / 1e9) ** 2 / 8.0 * (math.tau / (period / 1e9)) ** 2

    def bounds(stamp):
        drift = squared('odom', DRIFT_PERIOD, stamp)
        drive = squared('base_link', motion.lap_time, stamp)
        arm = squared('gripper', ARM_PERIOD, stamp)
        drift_angle, arm_angle = math.radians(3.0) * drift, (0.4 + 0.3 + 0.4 * 0.3) * arm
        reach = motion.radius + 1.1
        # The heading rotates at a constant rate, which slerp follows exactly.
        furthest = 0.5 * drift + drift_angle * reach + motion.radius * drive + 0.25 * arm
        return furthest, drift_angle + arm_angle

    tightest = []
    for earlier, later in zip(stamps['gripper'], stamps['gripper'][1:], strict=False):
        stamp = (earlier + later) // 2
        if first <= stamp < last:
            furthest, worst_angle = bounds(stamp)
            error = motion.world_T_gripper(stamp).inverse() @ buffer.lookup(
                'world', 'gripper', stamp)
            assert math.hypot(*error.translation) <= furthest
            assert math.hypot(*error.as_rotation_vector()) <= worst_angle
            tightest.append(furthest)
    assert len(tightest) > 20
    # A busy machine leaves gaps, but not everywhere, so the bound is tight somewhere.
    assert min(tightest) < 0.01


def test_moving_transforms_have_rates_of_their_own(context):
    node = publisher(context, drive_rate_hz=20.0)
    # Whether a busy machine keeps these rates is not tested.
    periods = [timer.timer_period_ns for timer in node.timers]
    assert sorted(periods) == [20_000_000, 50_000_000, 100_000_000]
    node.destroy_node()


def test_prefix_goes_before_every_frame_and_frames_can_be_renamed(context, buffer):
    with spun_in_background(publisher(context, frame_prefix='r1/', gripper_frame='hand')):
        buffer.lookup_within(PATIENCE_S, 'r1/world', 'r1/hand')
        buffer.lookup_within(PATIENCE_S, 'r1/world', 'r1/camera')
    assert {(edge.parent, edge.child, edge.static) for edge in buffer.edges()} == {
        ('r1/world', 'r1/odom', False), ('r1/odom', 'r1/base_link', False),
        ('r1/base_link', 'r1/hand', False), ('r1/base_link', 'r1/camera', True)}


def test_radius_and_lap_time_are_those_asked_for(context, buffer):
    # An integer is also a number.
    with spun_in_background(publisher(context, radius=5, lap_time_s=7.5)):
        pose = buffer.lookup_within(PATIENCE_S, 'odom', 'base_link')
    assert math.hypot(pose.x, pose.y) == pytest.approx(5.0)


@pytest.mark.parametrize(('name', 'value', 'message'), [
    ('radius', -1.0, 'radius must be a number from 0.01 to 1000.0, not -1.0'),
    ('radius', math.nan, 'not nan'),
    ('lap_time_s', 'quick', "not 'quick'"),
    ('arm_rate_hz', 0, 'arm_rate_hz must be a number from 0.1 to 1000.0, not 0'),
    ('drive_rate_hz', True, 'not True'),
    ('frame_prefix', 7, 'frame_prefix must be a string, not 7'),
    ('frame_prefix', '/r1/', 'without a leading slash'),
    ('odom_frame', '', "odom_frame must be a frame name.*''"),
    ('odom_frame', 'world', 'need five names'),
])
def test_parameter_that_cannot_be_is_refused(context, name, value, message):
    with pytest.raises(BadInput, match=message):
        publisher(context, **{name: value})


def test_every_parameter_is_described_and_stays_what_it_is(context):
    node = publisher(context, radius=4.0)
    for setting in five_frame_publisher.SETTINGS:
        described = node.describe_parameter(setting.name)
        assert described.description
        assert described.type == Parameter.Type.from_parameter_value(setting.default).value
        assert bool(described.floating_point_range) == isinstance(setting.default, float)
    assert node.get_parameter('radius').value == 4.0
    assert not node.set_parameters([Parameter('radius', value=2.0)])[0].successful
    node.destroy_node()


@pytest.mark.parametrize('module', [five_frame_publisher, five_frame_listener])
def test_example_configuration_holds_every_parameter_with_its_default(module):
    config = yaml.safe_load(CONFIG.read_text())
    told = {**config['/**']['ros__parameters'], **config[f'/**/{module.NAME}']['ros__parameters']}
    assert told == {setting.name: setting.default for setting in module.SETTINGS}
