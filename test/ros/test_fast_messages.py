# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages created without their constructors equal those that the constructors create."""

from copy import deepcopy

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    Point,
    Point32,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TwistStamped,
)
from inputs import for_each
from message_tools import fields, filled
from nav_msgs.msg import Odometry, Path
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
from tf_tree_py.ros.messages.fast_messages import (
    copy_of,
    maker,
    many_maker,
    public_maker,
    public_many_maker,
    public_reader,
    public_whole_maker,
    reader,
    slots_are_known,
    slotted_maker,
    slotted_many_maker,
    slotted_reader,
    slotted_whole_maker,
    whole_maker,
)

KINDS = [*TRANSFORMERS, Header, Time, PointField]


@for_each(kind=KINDS)
def test_slotted_message_equals_the_public_one(kind):
    assert slots_are_known(kind)
    values = [value for _, value in fields(filled(kind, np.random.default_rng(1)))]
    slotted, public = slotted_maker(kind)(*values), public_maker(kind)(*values)
    assert type(slotted) is kind
    assert slotted == public
    assert repr(slotted) == repr(public)
    # Not the bytes themselves: the padding between the fields is uninitialised memory.
    assert deserialize_message(serialize_message(slotted), kind) == deserialize_message(
        serialize_message(public), kind)
    assert deepcopy(slotted) == public


def leaves(message):
    """Return the values in a message that are not messages, in order."""
    if not hasattr(message, 'get_fields_and_field_types'):
        return [message]
    return [leaf for _, value in fields(message) for leaf in leaves(value)]


@for_each(kind=KINDS)
def test_whole_message_is_made_of_all_its_values(kind):
    wanted = filled(kind, np.random.default_rng(1))
    values, sent = leaves(wanted), deserialize_message(serialize_message(wanted), kind)
    for make_maker in (slotted_whole_maker, public_whole_maker, whole_maker):
        made = make_maker(kind)(*values)
        assert type(made) is kind
        assert repr(made) == repr(wanted)
        assert deserialize_message(serialize_message(made), kind) == sent
        assert deepcopy(made) == wanted
        with pytest.raises((TypeError, ValueError)):
            make_maker(kind)(*values, 1.0)
        with pytest.raises((TypeError, ValueError)):
            make_maker(kind)(*values[1:])


@for_each(kind=[Point, Point32, Pose, Quaternion, PoseStamped], count=[0, 1, 5])
def test_many_are_made_and_read_as_one_by_one(kind, count):
    rng = np.random.default_rng(3)
    messages = [filled(kind, rng) for _ in range(count)]
    columns = slotted_reader(kind)(messages)
    assert columns == public_reader(kind)(messages)
    assert columns == [[dict(fields(message))[name] for message in messages]
                       for name, _ in fields(kind())]
    for make_many in (slotted_many_maker(kind), public_many_maker(kind)):
        made = make_many(*columns)
        assert made == messages
        assert [type(message) for message in made] == [kind] * count
        assert not {id(message) for message in made} & {id(message) for message in messages}
    if count:
        made[0].__init__()
        assert messages[0] != made[0]


@pytest.mark.parametrize('kind', [Point, Odometry, PointCloud2], ids=lambda kind: kind.__name__)
def test_slotted_message_is_as_good_as_any_to_its_owner(kind):
    values = [value for _, value in fields(filled(kind, np.random.default_rng(1)))]
    message = maker(kind)(*values)
    for field, value in fields(filled(kind, np.random.default_rng(2))):
        setattr(message, field, value)
        assert getattr(message, field) == value or isinstance(value, list | np.ndarray)


def test_messages_of_one_maker_share_nothing():
    make = maker(Point)
    one, other = make(1.0, 2.0, 3.0), make(1.0, 2.0, 3.0)
    one.x = 9.0
    assert other.x == 1.0


@pytest.mark.parametrize('kind', [Path, Pose, Point32, TwistStamped, PoseWithCovarianceStamped])
def test_a_maker_wants_all_fields(kind):
    for make in (slotted_maker(kind), public_maker(kind)):
        with pytest.raises((TypeError, ValueError)):
            make()


@pytest.mark.parametrize('slots', [['_x', '_y', '_z'], ['_x', '_y', '_z', '_w', '_check_fields'],
                                   ['x', 'y', 'z', '_check_fields'], []])
def test_other_slots_are_noticed_and_the_constructor_is_used(slots):
    class Other:

        def __init__(self, **values):
            self.values = values

        @staticmethod
        def get_fields_and_field_types():
            return {'x': 'double', 'y': 'double', 'z': 'double'}

    Other.__slots__ = slots
    assert not slots_are_known(Other)
    assert maker(Other)(1.0, 2.0, 3.0).values == {'x': 1.0, 'y': 2.0, 'z': 3.0}
    one, other = many_maker(Other)([1.0, 2.0], [3.0, 4.0], [5.0, 6.0])
    assert other.values == {'x': 2.0, 'y': 4.0, 'z': 6.0}
    assert one.values == {'x': 1.0, 'y': 3.0, 'z': 5.0}
    assert reader(Other)([Point(x=1.0), Point(y=2.0)]) == [[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]]


def test_header_is_copied():
    header = Header(frame_id='base', stamp=Time(sec=1, nanosec=2))
    twin, elsewhere = copy_of(header), copy_of(header, 'map')
    assert twin == header
    assert (elsewhere.frame_id, elsewhere.stamp) == ('map', header.stamp)
    twin.stamp.sec = 5
    elsewhere.stamp.sec = 6
    assert header.stamp.sec == 1
