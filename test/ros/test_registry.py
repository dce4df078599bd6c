# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""User-defined objects, conversions, and the two transform methods of every buffer."""

from copy import deepcopy

from geometry_msgs import msg
from geometry_msgs.msg import Point, PointStamped
from inputs import for_each
from message_tools import assert_shares_nothing, filled
import numpy as np
import pytest
from ros_helpers import at, move, PATIENCE, transform, until_waiting
from sensor_msgs.msg import Imu, LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import Buffer, LookupException
from tf_tree_py.ros.buffer.interface import BufferInterface
from tf_tree_py.ros.messages import registry
from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
from tf_tree_py.ros.messages.registry import convert, ConvertRegistration, Stamped, TypeException


class Landmark:
    """A user-defined object."""

    def __init__(self, name, x):
        self.name = name
        self.x = x


TREE = Landmark('tree', 2.0)


@pytest.fixture(autouse=True)
def empty_registry(monkeypatch):
    for name in ('_transformers', '_from_msg', '_to_msg', '_converters'):
        monkeypatch.setattr(registry, name, {})


@pytest.fixture
def buffer(buffer):
    move(buffer, 3.0)
    return buffer


# --- registration


def test_own_transformation_is_used_printed_and_goes_before_the_table(buffer, capsys):
    registry.TransformRegistration().add(
        Landmark, lambda mark, transform: mark.x + transform.transform.translation.x)
    assert registry.TransformRegistration().get(Landmark)(TREE, transform('a', 'b', x=2.0)) == 4.0
    assert buffer.transform(Stamped(Landmark('tree', 1.0), at(2), 'base'), 'map') == 3.0
    registry.TransformRegistration().print_me()
    printed = capsys.readouterr().out
    assert 'Landmark' in printed and 'PointStamped' in printed
    registry.TransformRegistration().add(PointStamped, lambda point, transform: 'mine')
    assert registry.TransformRegistration().get(PointStamped)(None, None) == 'mine'


@for_each(get_and_fixes=[
    (lambda: registry.TransformRegistration().get(Imu),
     ['not loaded or supported', 'Imu', 'TransformRegistration().add(type, function)',
      'PointCloud2']),
    (lambda: Buffer().transform(Imu(), 'map'), ['not loaded or supported']),
    (lambda: ConvertRegistration().get_to_msg(Landmark), ['add_to_msg(type, function)']),
    (lambda: ConvertRegistration().get_from_msg(Landmark), ['add_from_msg(type, function)']),
    (lambda: ConvertRegistration().get_convert((Landmark, str)), ['not loaded or supported']),
    (lambda: Stamped(msg.Point32(), at(1), 'base'), ['A Point32 cannot have a header']),
])
def test_what_is_not_registered_is_refused_with_the_fix(get_and_fixes):
    get, fixes = get_and_fixes
    with pytest.raises(TypeException) as caught:
        get()
    assert caught.value.errstr == str(caught.value)
    assert all(fix in str(caught.value) for fix in fixes)


# --- conversion


def test_converting_to_the_same_type_copies():
    point = filled(PointStamped, np.random.default_rng(1))
    assert_shares_nothing(lambda point: convert(point, PointStamped), point)
    assert convert(point, PointStamped) == point


def test_own_conversions_go_first_the_direct_one_before_all():
    conversions, point = ConvertRegistration(), PointStamped()
    assert conversions.get_to_msg(PointStamped)(point) is point
    assert conversions.get_from_msg(PointStamped)(point) is point

    conversions.add_to_msg(Landmark, lambda mark: PointStamped(point=Point(x=mark.x)))
    conversions.add_from_msg(float, lambda point: point.point.x)
    assert convert(TREE, float) == 2.0
    assert convert(TREE, PointStamped).point.x == 2.0

    conversions.add_to_msg(PointStamped, lambda point: 'to')
    conversions.add_from_msg(PointStamped, lambda message: 'from')
    assert conversions.get_to_msg(PointStamped)(None) == 'to'
    assert conversions.get_from_msg(PointStamped)(None) == 'from'

    conversions.add_convert((Landmark, str), lambda mark: mark.name)
    conversions.add_convert((PointStamped, PointStamped), lambda point: 'direct')
    assert convert(TREE, str) == 'tree'
    assert convert(point, PointStamped) == 'direct'
    assert conversions.get_convert((Landmark, str))(TREE) == 'tree'


def test_one_message_does_not_pass_for_another():
    with pytest.raises(TypeException, match='A PointStamped cannot be converted to a PoseStamped'):
        convert(PointStamped(), msg.PoseStamped)


# --- Stamped


def test_every_type_with_a_stamped_form_gets_a_header():
    names = {cls.__name__ for cls in TRANSFORMERS}
    bare = {cls for cls in TRANSFORMERS if f'{cls.__name__}Stamped' in names}
    assert bare == set(registry.STAMPED_FORMS)


@for_each(cls=registry.STAMPED_FORMS)
def test_stamped_gives_a_message_its_form_with_a_header(cls):
    message = filled(cls, np.random.default_rng(2))
    before = deepcopy(message)
    result = Stamped(message, at(3.5), 'base')
    assert (result.header.frame_id, result.header.stamp) == ('base', at(3.5).to_msg())
    form, field = registry.STAMPED_FORMS[cls]
    assert type(result) is form
    assert getattr(result, field) == before
    assert getattr(result, field) is not message
    assert type(result) in TRANSFORMERS


def test_stamped_gives_a_header_to_what_can_bear_one():
    point, mark = PointStamped(), Landmark('tree', 1.0)
    assert Stamped(point, at(2).to_msg(), 'base') is point
    assert (point.header.frame_id, point.header.stamp.sec) == ('base', 2)
    assert Stamped(mark, at(2), 'base') is mark
    assert mark.header == point.header


# --- buffer.transform


def stamped_point(frame, seconds):
    return Stamped(Point(y=1.0), at(seconds), frame)


def test_point_is_taken_to_another_frame_and_time(buffer):
    moved = buffer.transform(stamped_point('base', 2.5), 'map')
    assert (moved.header.frame_id, moved.header.stamp) == ('map', at(2.5).to_msg())
    assert (moved.point.x, moved.point.y) == (2.5, 1.0)
    full = 'base', at(3), 'map'
    moved = buffer.transform_full(stamped_point('base', 1), *full)
    assert (moved.header.frame_id, moved.header.stamp.sec) == ('base', 3)
    assert (moved.point.x, moved.point.y) == (-2.0, 1.0)

    ConvertRegistration().add_from_msg(float, lambda point: point.point.x)
    assert buffer.transform(stamped_point('base', 2), 'map', new_type=float) == 2.0
    assert buffer.transform_full(stamped_point('base', 1), *full, new_type=float) == -2.0
    same = buffer.transform(stamped_point('base', 2), 'map', new_type=PointStamped)
    assert type(same) is PointStamped


@for_each(cls=TRANSFORMERS)
def test_every_kind_goes_through_a_buffer_with_a_header(buffer, cls):
    message = filled(cls, np.random.default_rng(3))
    if cls in (LaserScan, PointCloud2):
        message = cls()
    header = Header(frame_id='base', stamp=at(2).to_msg())
    if hasattr(cls, 'header'):
        message.header = header
        result = buffer.transform(message, 'map')
        assert (result.header.frame_id, result.header.stamp) == ('map', header.stamp)
    else:
        result = buffer.transform(message, 'map', header=header)
        with pytest.raises(TypeException, match=f'A {cls.__name__} has no header.*pass header='):
            buffer.transform(message, 'map')
        with pytest.raises(TypeException, match='has no header'):
            buffer.transform_full(message, 'map', at(1), 'map')
    assert type(result) is (PointCloud2 if cls is LaserScan else cls)


def test_header_that_is_given_says_where_and_when_a_message_is(buffer):
    header = Header(frame_id='base', stamp=at(2).to_msg())
    assert buffer.transform(Point(y=1.0), 'map', header=header) == Point(x=2.0, y=1.0)
    assert buffer.transform(msg.Pose(), 'map', header=header).position == Point(x=2.0)
    full = buffer.transform_full(Point(y=1.0), 'base', at(3), 'map', header=header)
    assert full == Point(x=-1.0, y=1.0)
    elsewhere = Header(frame_id='base', stamp=at(3).to_msg())
    assert buffer.transform(stamped_point('base', 1), 'map', header=elsewhere).point.x == 3.0


def test_errors_come_through_and_timeouts_are_waited_for(buffer, pool):
    with pytest.raises(LookupException, match='"nowhere"'):
        buffer.transform(stamped_point('nowhere', 1), 'map')
    late = pool.submit(buffer.transform, stamped_point('base', 4), 'map', PATIENCE)
    fuller = pool.submit(buffer.transform_full, stamped_point('base', 4), 'base', at(1), 'map',
                         PATIENCE)
    until_waiting(buffer, 2)
    move(buffer, 4.0)
    assert late.result().point.x == 4.0
    assert fuller.result().point.x == 3.0


def test_interface_needs_a_lookup_beneath_it():
    interface = BufferInterface()
    for call in (lambda: interface.lookup_transform('a', 'b', at(1)),
                 lambda: interface.lookup_transform_full('a', at(1), 'b', at(1), 'c'),
                 lambda: interface.can_transform('a', 'b', at(1)),
                 lambda: interface.can_transform_full('a', at(1), 'b', at(1), 'c'),
                 lambda: interface.transform(stamped_point('a', 1), 'b')):
        with pytest.raises(registry.NotImplementedException, match='not implemented'):
            call()
    assert registry.NotImplementedException().errstr == str(registry.NotImplementedException())
