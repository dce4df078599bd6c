# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages created without their constructors equal those that the constructors create."""

from copy import deepcopy

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Point32, Pose, PoseStamped, Quaternion
from inputs import for_each
from message_tools import fields, filled, is_message
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.ros.messages import fast_messages as fast
from tf_tree_py.ros.messages.do_transform import TRANSFORMERS

TYPES = [*TRANSFORMERS, Header, Time, PointField]


def values_in(message, is_whole):
    """Return the values of the fields of a message; of the whole, those that are not messages."""
    return [inner for _, value in fields(message) for inner in (
        values_in(value, True) if is_whole and is_message(value) else [value])]


@for_each(cls=TYPES)
def test_message_is_made_of_all_its_values_and_no_others(cls):
    assert fast.slots_are_known(cls)
    wanted = filled(cls, np.random.default_rng(1))
    sent = deserialize_message(serialize_message(wanted), cls)
    for is_whole, makers in enumerate([
            [fast.maker, fast.slotted_maker, fast.public_maker],
            [fast.whole_maker, fast.slotted_whole_maker, fast.public_whole_maker]]):
        values = values_in(wanted, is_whole)
        for make in (make_maker(cls) for make_maker in makers):
            made = make(*values)
            assert type(made) is cls
            assert repr(made) == repr(wanted)
            # Not the bytes themselves: the padding between the fields is uninitialised memory.
            assert deserialize_message(serialize_message(made), cls) == sent
            assert deepcopy(made) == wanted
            for wrong in ([*values, 1.0], values[1:], []):
                with pytest.raises((TypeError, ValueError)):
                    make(*wrong)


@for_each(cls=[Point, Point32, Pose, Quaternion, PoseStamped], count=[0, 1, 5])
def test_many_are_made_and_read_as_one_by_one(cls, count):
    rng = np.random.default_rng(3)
    messages = [filled(cls, rng) for _ in range(count)]
    columns = fast.slotted_reader(cls)(messages)
    assert columns == fast.public_reader(cls)(messages)
    assert columns == [[dict(fields(message))[name] for message in messages]
                       for name, _ in fields(cls())]
    for make_many in (fast.slotted_many_maker(cls), fast.public_many_maker(cls)):
        made = make_many(*columns)
        assert made == messages
        assert [type(message) for message in made] == [cls] * count
        assert not {id(message) for message in made} & {id(message) for message in messages}


@for_each(cls=[Point, Odometry, PointCloud2])
def test_message_is_as_good_as_any_to_its_owner_and_shares_nothing(cls):
    before, after = (filled(cls, np.random.default_rng(seed)) for seed in (1, 2))
    one, other = (fast.maker(cls)(*values_in(before, False)) for _ in range(2))
    for field, value in fields(after):
        setattr(one, field, value)
        assert getattr(one, field) == value or isinstance(value, list | np.ndarray)
    assert repr(one) == repr(after)
    assert repr(other) == repr(before)


@pytest.mark.parametrize('slots', [['_x', '_y', '_z'], ['_x', '_y', '_z', '_w', '_check_fields'],
                                   ['x', 'y', 'z', '_check_fields'], []])
def test_other_slots_are_noticed_and_the_constructor_is_used(slots):
    class Other:

        x = y = z = 0.0

        def __init__(self, **values):
            self.values = values

        @staticmethod
        def get_fields_and_field_types():
            return {'x': 'double', 'y': 'double', 'z': 'double'}

    class Whole(Other):

        __slots__ = ['_other', '_check_fields']
        other = Other()

        @staticmethod
        def get_fields_and_field_types():
            return {'other': 'Other'}

    Other.__slots__ = slots
    assert not fast.slots_are_known(Other)
    assert fast.slots_are_known(Whole)
    wanted = {'x': 1.0, 'y': 2.0, 'z': 3.0}
    assert fast.maker(Other)(1.0, 2.0, 3.0).values == wanted
    assert fast.whole_maker(Whole)(1.0, 2.0, 3.0).values['other'].values == wanted
    one, other = fast.many_maker(Other)([1.0, 2.0], [3.0, 4.0], [5.0, 6.0])
    assert other.values == {'x': 2.0, 'y': 4.0, 'z': 6.0}
    assert one.values == {'x': 1.0, 'y': 3.0, 'z': 5.0}
    assert fast.reader(Other)([Point(x=1.0), Point(y=2.0)]) == [[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]]


def test_header_is_copied():
    header = Header(frame_id='base', stamp=Time(sec=1, nanosec=2))
    twin, elsewhere = fast.copy_of(header), fast.copy_of(header, 'map')
    assert twin == header
    assert (elsewhere.frame_id, elsewhere.stamp) == ('map', header.stamp)
    twin.stamp.sec = 5
    elsewhere.stamp.sec = 6
    assert header.stamp.sec == 1
