# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""User-defined objects, conversions, and the two transform methods of every buffer."""

from copy import deepcopy

from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Transform,
    TransformStamped,
    Twist,
    Wrench,
)
from inputs import for_each
from message_tools import filled, stamped_transform
import numpy as np
import pytest
from ros_helpers import at, lasting, transform
from sensor_msgs.msg import Imu, LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import Buffer, FutureExtrapolationException, LookupException
from tf_tree_py.ros.buffer.interface import BufferInterface
from tf_tree_py.ros.messages import registry
from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
from tf_tree_py.ros.messages.registry import (
    convert,
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    STAMPED_FORMS,
    TransformRegistration,
    TypeException,
)


class Landmark:
    """A user-defined object."""

    def __init__(self, name, x):
        self.name = name
        self.x = x


@pytest.fixture(autouse=True)
def empty_registry(monkeypatch):
    for name in ('_transformers', '_from_msg', '_to_msg', '_converters'):
        monkeypatch.setattr(registry, name, {})


@pytest.fixture
def buffer():
    buffer = Buffer()
    for second in (1, 2, 3):
        buffer.set_transform(transform('map', 'base', second, x=float(second)))
    buffer.set_transform_static(transform('base', 'lidar', z=1.0, w=0.0))
    return buffer


# --- registration


@for_each(kind=TRANSFORMERS)
def test_messages_need_no_registration(kind):
    assert TransformRegistration().get(kind) is TRANSFORMERS[kind]


def test_own_type_is_transformed_as_it_says():
    TransformRegistration().add(
        Landmark, lambda mark, transform: Landmark(
            mark.name, mark.x + transform.transform.translation.x))
    moved = TransformRegistration().get(Landmark)(Landmark('tree', 1.0), transform('a', 'b', x=2.))
    assert (moved.name, moved.x) == ('tree', 3.0)


def test_own_way_goes_before_the_table():
    TransformRegistration().add(PointStamped, lambda point, transform: 'mine')
    assert TransformRegistration().get(PointStamped)(None, None) == 'mine'


def test_unknown_type_is_refused_with_the_fix():
    with pytest.raises(TypeException, match='not loaded or supported') as caught:
        TransformRegistration().get(Imu)
    text = str(caught.value)
    assert caught.value.errstr == text
    assert 'Imu' in text
    assert 'TransformRegistration().add(type, function)' in text
    assert 'PointCloud2' in text


def test_registry_is_printed(capsys):
    TransformRegistration().add(Landmark, len)
    TransformRegistration().print_me()
    printed = capsys.readouterr().out
    assert 'Landmark' in printed
    assert 'PointStamped' in printed


# --- conversion


def test_converting_to_the_same_type_copies():
    point = filled(PointStamped, np.random.default_rng(1))
    copied = convert(point, PointStamped)
    assert copied == point
    copied.header.stamp.sec += 1
    copied.point.x += 1.0
    assert copied.header.stamp.sec != point.header.stamp.sec
    assert copied.point.x != point.point.x


def test_converting_by_way_of_a_message():
    ConvertRegistration().add_to_msg(Landmark, lambda mark: PointStamped(point=Point(x=mark.x)))
    ConvertRegistration().add_from_msg(float, lambda point: point.point.x)
    assert convert(Landmark('tree', 2.0), float) == 2.0
    assert convert(Landmark('tree', 2.0), PointStamped).point.x == 2.0


def test_converting_straight_goes_first():
    ConvertRegistration().add_convert((Landmark, str), lambda mark: mark.name)
    ConvertRegistration().add_convert((PointStamped, PointStamped), lambda point: 'straight')
    assert convert(Landmark('tree', 2.0), str) == 'tree'
    assert convert(PointStamped(), PointStamped) == 'straight'
    assert ConvertRegistration().get_convert((Landmark, str))(Landmark('tree', 0.0)) == 'tree'


def test_messages_become_themselves():
    point = PointStamped()
    assert ConvertRegistration().get_to_msg(PointStamped)(point) is point
    assert ConvertRegistration().get_from_msg(PointStamped)(point) is point


def test_own_conversion_of_a_message_goes_first():
    ConvertRegistration().add_to_msg(PointStamped, lambda point: 'to')
    ConvertRegistration().add_from_msg(PointStamped, lambda message: 'from')
    assert ConvertRegistration().get_to_msg(PointStamped)(None) == 'to'
    assert ConvertRegistration().get_from_msg(PointStamped)(None) == 'from'


@pytest.mark.parametrize(('get', 'fix'), [('get_to_msg', 'add_to_msg'),
                                          ('get_from_msg', 'add_from_msg')])
def test_unknown_conversion_is_refused_with_the_fix(get, fix):
    with pytest.raises(TypeException, match=rf'{fix}\(type, function\)'):
        getattr(ConvertRegistration(), get)(Landmark)
    with pytest.raises(TypeException, match='not loaded or supported'):
        ConvertRegistration().get_convert((Landmark, str))


def test_one_message_does_not_pass_for_another():
    with pytest.raises(TypeException, match='A PointStamped cannot be converted to a PoseStamped'):
        convert(PointStamped(), PoseStamped)


# --- Stamped


@for_each(kind=STAMPED_FORMS)
def test_stamped_gives_a_message_its_form_with_a_header(kind):
    message = filled(kind, np.random.default_rng(2))
    before = deepcopy(message)
    result = Stamped(message, at(3.5), 'base')
    assert (result.header.frame_id, result.header.stamp) == ('base', at(3.5).to_msg())
    form, field = STAMPED_FORMS[kind]
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


def test_stamped_refuses_what_cannot():
    with pytest.raises(TypeException, match='A Point32 cannot have a header'):
        Stamped(Point32(), at(1), 'base')


# --- buffer.transform


def stamped_point(frame, seconds):
    return Stamped(Point(y=1.0), at(seconds), frame)


def test_a_point_is_taken_to_another_frame_at_its_own_time(buffer):
    moved = buffer.transform(stamped_point('base', 2.5), 'map')
    assert (moved.header.frame_id, moved.header.stamp) == ('map', at(2.5).to_msg())
    assert (moved.point.x, moved.point.y) == (2.5, 1.0)


def test_a_point_is_taken_to_another_frame_and_another_time(buffer):
    moved = buffer.transform_full(stamped_point('base', 1), 'base', at(3), 'map')
    assert (moved.header.frame_id, moved.header.stamp.sec) == ('base', 3)
    assert (moved.point.x, moved.point.y) == (-2.0, 1.0)


@for_each(kind=TRANSFORMERS)
def test_every_kind_goes_through_a_buffer(buffer, kind):
    message = filled(kind, np.random.default_rng(3))
    if kind in (LaserScan, PointCloud2):
        message = kind()
    header = Header(frame_id='base', stamp=at(2).to_msg())
    if hasattr(kind, 'header'):
        message.header = header
        result = buffer.transform(message, 'map')
        assert (result.header.frame_id, result.header.stamp) == ('map', header.stamp)
    else:
        result = buffer.transform(message, 'map', header=header)
    assert type(result) is (PointCloud2 if kind is LaserScan else kind)


def test_messages_without_header_take_one_that_is_given(buffer):
    header = Header(frame_id='base', stamp=at(2).to_msg())
    assert buffer.transform(Point(y=1.0), 'map', header=header) == Point(x=2.0, y=1.0)
    pose = buffer.transform(Pose(), 'map', header=header)
    assert pose.position == Point(x=2.0)
    full = buffer.transform_full(Point(y=1.0), 'base', at(3), 'map', header=header)
    assert full == Point(x=-1.0, y=1.0)
    elsewhere = Header(frame_id='base', stamp=at(3).to_msg())
    assert buffer.transform(stamped_point('base', 1), 'map', header=elsewhere).point.x == 3.0


@pytest.mark.parametrize('kind', [Point, Twist, Wrench, PoseWithCovariance, Transform])
def test_messages_without_header_are_refused_without_one(buffer, kind):
    with pytest.raises(TypeException, match=f'A {kind.__name__} has no header.*pass header='):
        buffer.transform(kind(), 'map')
    with pytest.raises(TypeException, match='has no header'):
        buffer.transform_full(kind(), 'map', at(1), 'map')


def test_result_is_converted(buffer):
    ConvertRegistration().add_from_msg(float, lambda point: point.point.x)
    assert buffer.transform(stamped_point('base', 2), 'map', new_type=float) == 2.0
    assert buffer.transform_full(
        stamped_point('base', 1), 'base', at(3), 'map', new_type=float) == -2.0
    assert type(buffer.transform(stamped_point('base', 2), 'map', new_type=PointStamped)
                ) is PointStamped


def test_own_type_goes_through_a_buffer(buffer):
    TransformRegistration().add(
        Landmark, lambda mark, transform: transform.transform.translation.x + mark.x)
    assert buffer.transform(Stamped(Landmark('tree', 1.0), at(2), 'base'), 'map') == 3.0


def test_errors_come_through(buffer):
    with pytest.raises(LookupException, match='"nowhere"'):
        buffer.transform(stamped_point('nowhere', 1), 'map')
    with pytest.raises(FutureExtrapolationException):
        buffer.transform(stamped_point('base', 9), 'map')
    with pytest.raises(TypeException, match='not loaded or supported'):
        buffer.transform(Imu(), 'map')


def test_timeout_is_waited_for(buffer, pool):
    late = pool.submit(buffer.transform, stamped_point('base', 4), 'map', lasting(20))
    fuller = pool.submit(buffer.transform_full, stamped_point('base', 4), 'base', at(1), 'map',
                         lasting(20))
    buffer.set_transform(transform('map', 'base', 4, x=4.0))
    assert late.result().point.x == 4.0
    assert fuller.result().point.x == 3.0


def test_interface_alone_looks_nothing_up():
    interface = BufferInterface()
    for call in (lambda: interface.lookup_transform('a', 'b', at(1)),
                 lambda: interface.lookup_transform_full('a', at(1), 'b', at(1), 'c'),
                 lambda: interface.can_transform('a', 'b', at(1)),
                 lambda: interface.can_transform_full('a', at(1), 'b', at(1), 'c'),
                 lambda: interface.transform(stamped_point('a', 1), 'b')):
        with pytest.raises(NotImplementedException, match='not implemented'):
            call()
    assert NotImplementedException().errstr == str(NotImplementedException())


def test_a_lookup_of_another_kind_can_be_beneath(buffer):
    class Fixed(BufferInterface):

        def lookup_transform(self, target_frame, source_frame, time, timeout=None):
            return stamped_transform((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), target_frame)

    moved = Fixed().transform(stamped_point('anything', 1), 'there')
    assert (moved.header.frame_id, moved.point.x) == ('there', 1.0)
    assert type(buffer.lookup_transform('map', 'base', at(2))) is TransformStamped
