# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Topics of any type whose messages carry poses fill a buffer, as /tf does."""


import gc
import threading
import weakref

from geometry_msgs.msg import (
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
)
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.node import Node
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    receivers,
    SIM_TIME,
    until,
    until_waiting,
)
from std_msgs.msg import Header, String
from tf_tree_py import (
    Buffer,
    Pose,
    PoseSample,
    SharedTreeException,
    StaleException,
    TransformListener,
)
from tf_tree_py.core import Kind
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.ros.messages.convert import transform_message
from tf_tree_py.ros.messages.geometry import pose_message
from tf_tree_py.ros.topics.qos import static_qos

TURNED = Pose(1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8)
COVARIANCE = np.diag([4e-4, 4e-4, 1e-4, 1e-4, 1e-4, 1e-4])
UNKNOWN = np.diag([1e-4, 1e-4, 1e6, 1e6, 1e6, 1e-4])
S = 1_000_000_000


def header(frame='odom', seconds=1.5):
    return Header(frame_id=frame, stamp=at(seconds).to_msg())


def odometry(seconds=1.5, covariance=COVARIANCE, parent='odom', child='base', pose=TURNED):
    message = Odometry(header=header(parent, seconds), child_frame_id=child)
    message.pose.pose = pose_message(pose)
    message.pose.covariance = np.ravel(covariance)
    return message


def with_covariance(message):
    return PoseWithCovarianceStamped(header=message.header, pose=message.pose)


MESSAGES = {
    'Odometry': (odometry(), {}),
    'Odometry of another child': (odometry(child='wheels'), {'child': 'base'}),
    'Odometry of another parent': (odometry(parent='start'), {'parent': 'odom'}),
    'PoseStamped': (PoseStamped(header=header(), pose=pose_message(TURNED)), {'child': 'base'}),
    'PoseWithCovarianceStamped': (with_covariance(odometry()), {'child': 'base'}),
    'TransformStamped': (TransformStamped(header=header(), child_frame_id='base',
                                          transform=transform_message(TURNED)), {}),
    'a leading slash': (odometry(parent='/odom', child='/base'), {}),
}


@pytest.fixture
def listener(node):
    with TransformListener(Buffer(), node) as listener:
        yield listener


@pytest.fixture
def send(talker):
    """Return a function that publishes on a topic when all its listeners hear it."""
    publishers = {}

    def send(topic, *messages, listeners=1, qos=100):
        if topic not in publishers:
            publishers[topic] = talker.node.create_publisher(type(messages[0]), topic, qos)
        talker.until_heard(publishers[topic], listeners)
        for message in messages:
            publishers[topic].publish(message)

    return send


def until_has(listener, child='base'):
    until(lambda: child in listener.buffer.frames())
    return listener.buffer


def incidents_of(buffer):
    return {kind: count for kind, count in buffer.statistics().incidents.items() if count}


# --- the types

@pytest.mark.parametrize(('message', 'options'), MESSAGES.values(), ids=MESSAGES)
@pytest.mark.parametrize('static', [False, True], ids=['moving', 'static'])
def test_each_common_type_is_read(listener, send, message, options, static):
    listener.subscribe(type(message), 'poses', static=static, **options)
    send('poses', message, qos=static_qos(1) if static else 100)
    buffer = until_has(listener)
    [edge] = buffer.edges()
    assert (edge.parent, edge.child, edge.static) == ('odom', 'base', static)
    assert edge.authority == '/talking'
    assert buffer.lookup('odom', 'base', at(7.0 if static else 1.5)) == pytest.approx(TURNED)
    assert not buffer.has_covariances
    assert buffer.statistics().refused == 0


def test_a_static_topic_reaches_late_listeners(node, talker, send):
    publisher = talker.node.create_publisher(TransformStamped, 'mount', static_qos(1))
    publisher.publish(MESSAGES['TransformStamped'][0])
    with TransformListener(Buffer(), node) as listener:
        listener.subscribe(TransformStamped, 'mount', static=True)
        until_has(listener)


SAMPLES = {
    'a Pose message': (pose_message(TURNED), at(1.5).to_msg()),
    'a Transform message': (transform_message(TURNED), at(1.5)),
    'a Pose': (TURNED, 1_500_000_000),
    'seven numbers': (list(TURNED), np.int64(1_500_000_000)),
    'a matrix': (TURNED.as_matrix(), np.datetime64(1_500_000_000, 'ns')),
}


@pytest.mark.parametrize(('pose', 'stamp'), SAMPLES.values(), ids=SAMPLES)
def test_a_reader_returns_any_pose_and_any_stamp(listener, send, pose, stamp):
    listener.subscribe(String, 'words', lambda message: PoseSample(
        'odom', message.data, stamp, pose))
    send('words', String(data='base'))
    assert until_has(listener).lookup('odom', 'base', at(1.5)) == pytest.approx(TURNED)


def test_a_users_own_type_in_ten_lines(listener, send):
    def read(message):
        for number, pose in enumerate(message.poses):
            yield PoseSample(message.header.frame_id, f'tag{number}', message.header.stamp, pose)

    listener.subscribe(PoseArray, 'tags', read)
    send('tags', PoseArray(header=header('camera'), poses=[
        pose_message(TURNED), pose_message(Pose(x=4.0))]))
    buffer = until_has(listener, 'tag1')
    assert buffer.lookup('camera', 'tag0') == pytest.approx(TURNED)
    assert buffer.lookup('camera', 'tag1').x == 4.0


@pytest.mark.parametrize('wrong', [
    PoseSample('odom', 'two', at(1.5), 'here'), PoseSample('odom', None, at(1.5), TURNED),
    PoseSample('odom', 'two', 1.5, TURNED), ('odom', 'two')])
def test_one_wrong_pose_of_a_message_loses_no_other(listener, send, wrong):
    good = [PoseSample('odom', child, at(1.5), TURNED) for child in ('one', 'three')]
    listener.subscribe(String, 'words', lambda message: [good[0], wrong, good[1]])
    send('words', String(data=''))
    assert sorted(until_has(listener, 'three').frames()) == ['odom', 'one', 'three']
    assert incidents_of(listener.buffer) == {Kind.MALFORMED: 1}


def test_what_a_reader_returned_before_it_failed_is_used(listener, send):
    def read(message):
        yield PoseSample('odom', 'one', at(1.5), TURNED)
        raise KeyError(message.data)

    listener.subscribe(String, 'words', read)
    send('words', String(data='unknown'))
    until_has(listener, 'one')


def test_a_reader_of_a_common_type_comes_first(listener, send):
    listener.subscribe(Odometry, 'odometry', lambda message: PoseSample(
        'odom', 'other', at(1.5), TURNED))
    send('odometry', odometry())
    assert sorted(until_has(listener, 'other').frames()) == ['odom', 'other']


def test_a_burst_of_many_frames_is_not_lost(listener, send):
    """One message for each body, all on one topic."""
    may_go_on = threading.Event()

    def read(message):
        may_go_on.wait(PATIENCE_S)
        return PoseSample('map', message.data, at(1.5), TURNED)

    listener.subscribe(String, 'bodies', read)
    send('bodies', *(String(data=f'body{number}') for number in range(100)), qos=200)
    may_go_on.set()
    until(lambda: len(listener.buffer.frames()) == 101)


def test_the_node_is_not_kept_alive_by_its_own_method(context, send):
    class Detector(Node):

        def __init__(self):
            super().__init__('detector', context=context)
            self.listener = TransformListener(Buffer(), self)
            self.listener.subscribe(String, 'words', self.read)

        def read(self, message):
            return PoseSample('odom', message.data, at(1.5), TURNED)

    detectors = [Detector()]
    send('words', String(data='base'))
    until(detectors[0].listener.buffer.frames)
    gone = weakref.ref(detectors.pop())
    gc.collect()
    assert gone() is None
    until(lambda: not receivers())


def test_a_reader_may_return_nothing(listener, send):
    listener.subscribe(String, 'words', lambda message: None if message.data == 'no' else [])
    listener.subscribe(Odometry, 'odometry')
    send('words', String(data='no'), String(data='yes'))
    send('odometry', odometry())
    assert until_has(listener).statistics().accepted == 1


# --- what is wrong

WRONG = {
    'an exception': (lambda message: 1 / 0,
                     'a message of type String cannot be read: ZeroDivisionError'),
    'an attribute': (lambda message: message.pose, "'String' object has no attribute 'pose'"),
    'no sample': (lambda message: [('odom', 'base')], 'a reader returns PoseSample, several or'),
    'not a pose': (lambda message: PoseSample('odom', 'base', 1, 'here'), 'cannot be read'),
    'no name': (lambda message: PoseSample('odom', None, 1, TURNED), 'and None must be strings'),
    'float seconds': (lambda message: PoseSample('odom', 'base', 1.5, TURNED), 'nanoseconds'),
}


@pytest.mark.parametrize(('read', 'sentence'), WRONG.values(), ids=WRONG)
def test_a_reader_that_fails_is_an_incident_and_the_listener_goes_on(
        listener, send, log, read, sentence):
    listener.subscribe(String, 'words', read)
    listener.subscribe(Odometry, 'odometry')
    send('words', String(data='base'))
    until(lambda: listener.buffer.statistics().incidents[Kind.MALFORMED] == 1)
    send('odometry', odometry())
    until_has(listener)
    until(lambda: sentence in log())


GARBAGE = {
    'parent': [None, 7, b'odom', '', 'base', '/', 'x' * 5000, '\ud800'],
    'child': [None, 7, b'base', '', 'odom', '/', 'x' * 5000, '\ud800'],
    'stamp': [None, 'now', float('nan'), 2 ** 80, -2 ** 63, Header(), lasting(1.0), [1]],
    'pose': [None, [], 'here', [float('nan')] * 7, [1e308] * 7, [2 ** 2000] * 7, np.zeros((4, 4)),
             Header(), 7],
    'covariance': ['wide', [1.0], [float('nan')] * 36, np.eye(3), {}, 7],
}
GARBLED = [{part: garbage} for part, each in GARBAGE.items() for garbage in each] + [
    {part: each[number % len(each)] for part, each in GARBAGE.items()} for number in range(20)]


def test_no_garbage_of_a_reader_ends_the_listener(listener, send):
    good = PoseSample('odom', 'base', at(1.5), TURNED, np.ravel(COVARIANCE))
    listener.subscribe(String, 'words', lambda message: good._replace(
        **GARBLED[int(message.data)]), covariances=True, qos=100)
    listener.subscribe(Odometry, 'odometry', child='end', qos=100)
    send('words', *(String(data=str(number)) for number in range(len(GARBLED))))
    buffer = listener.buffer
    # All but the first of all possible stamps.
    until(lambda: sum(incidents_of(buffer).values()) == len(GARBLED) - 1)
    send('odometry', odometry())
    until_has(listener, 'end')


@pytest.mark.parametrize(('message', 'kind'), [
    (odometry(child=''), Kind.EMPTY_FRAME),
    (odometry(child='odom'), Kind.SELF_EDGE),
    (odometry(pose=Pose(x=float('nan'))), Kind.NOT_FINITE),
    (odometry(pose=Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)), Kind.ZERO_ROTATION)])
def test_what_tf2_refuses_is_refused(listener, send, message, kind):
    listener.subscribe(Odometry, 'odometry')
    send('odometry', message, odometry(child='arm'))
    buffer = until_has(listener, 'arm')
    assert incidents_of(buffer) == {kind: 1}


def test_an_impossible_stamp_is_refused_unless_the_topic_is_static(listener, send):
    message = odometry()
    message.header.stamp.nanosec = 3_000_000_000
    listener.subscribe(Odometry, 'odometry')
    listener.subscribe(Odometry, 'mount', static=True, child='camera')
    send('odometry', message)
    until(lambda: listener.buffer.statistics().incidents[Kind.IMPOSSIBLE_STAMP] == 1)
    send('mount', message, qos=static_qos(1))
    assert 'base' not in until_has(listener, 'camera').frames()


def test_what_cannot_be_read_is_refused_at_once(listener):
    with pytest.raises(ValueError, match='String needs a function that reads it: pass read=.*'
                       'Without it: Odometry, PoseStamped, PoseWithCovarianceStamped, Transf'):
        listener.subscribe(String, 'words')
    for cls in PoseStamped, PoseWithCovarianceStamped:
        with pytest.raises(ValueError, match=f'a {cls.__name__} does not name .* pass child=...'):
            listener.subscribe(cls, 'poses')
    for wrong in ('nav_msgs/Odometry', 'odom'), (PoseStamped, 'mocap', 'drone'):
        with pytest.raises(TypeError, match='takes a type of message, a topic, and perhaps a'):
            listener.subscribe(*wrong)
    with pytest.raises(ValueError, match='pass covariances=True, too'):
        listener.subscribe(Odometry, 'odom', planar=True)
    listener.close()
    with pytest.raises(RuntimeError, match='this listener is closed'):
        listener.subscribe(Odometry, 'odometry')


def test_a_loop_names_both_publishers(listener, send):
    listener.subscribe(Odometry, 'odometry')
    send('odometry', odometry(), odometry(parent='base', child='odom'))
    until(lambda: listener.buffer.statistics().incidents[Kind.LOOP] == 1)


# --- the options of the listener hold for these, too

def test_prefixes_and_filters(node, send):
    with TransformListener(Buffer(), node, frame_prefix='robot1/', shared_frames=['map'],
                           frame_filter=lambda parent, child: child != 'arm') as listener:
        listener.subscribe(Odometry, 'odometry')
        send('odometry', odometry(child='arm'), odometry(parent='map', child='odom'), odometry())
        buffer = until_has(listener, 'robot1/base')
        assert buffer.frames() == ['robot1/odom', 'map', 'robot1/base']


def test_topic_is_resolved_as_in_the_node(make_node, send):
    node = make_node('robot', namespace='/robot1', use_global_arguments=False,
                     cli_args=['--ros-args', '-r', 'odometry:=wheels'])
    with TransformListener(Buffer(), node) as listener:
        listener.subscribe(Odometry, 'odometry')
        send('/robot1/wheels', odometry())
        until_has(listener)


def test_in_a_thread_of_the_user(node, send, spin):
    with TransformListener(Buffer(), node, spin_thread=False) as listener:
        listener.subscribe(Odometry, 'odometry')
        spin(node)
        send('odometry', odometry())
        until_has(listener)


def test_observers_see_each_message_with_its_topic(listener, send):
    seen = []

    class Watch(Observer):

        def received(self, arrival):
            seen.append(arrival)

    listener.buffer.observers.add(Watch())
    listener.subscribe(Odometry, 'odometry', covariances=True)
    send('odometry', odometry())
    buffer = until_has(listener)
    [arrival] = seen
    assert (arrival.topic, arrival.static, arrival.authority) == ('/odometry', False, '/talking')
    assert arrival.batch.samples()[0].child == 'base'
    assert buffer.has_covariances


def test_lookups_wait_for_them(listener, send, pool):
    listener.subscribe(Odometry, 'odometry')
    asked = pool.submit(listener.buffer.lookup_transform, 'odom', 'base', LATEST, PATIENCE)
    until_waiting(listener.buffer)
    send('odometry', odometry())
    assert asked.result(PATIENCE.nanoseconds / S).transform.translation.x == 1.0


def test_simulated_time_holds_for_them(make_node, sim_clock, send):
    node = make_node('asking', **SIM_TIME)
    with TransformListener(Buffer(max_age=lasting(1.0)), node) as listener:
        listener.subscribe(Odometry, 'odometry')
        sim_clock.show(2.0, listener.buffer)
        send('odometry', odometry())
        buffer = until_has(listener)
        assert buffer.lookup_transform('odom', 'base', LATEST)
        sim_clock.show(3.0, buffer)
        with pytest.raises(StaleException, match="last published by '/talking'"):
            buffer.lookup_transform('odom', 'base', LATEST)
        sim_clock.show(0.5, buffer)
        until(lambda: not buffer.can_transform('odom', 'base', at(1.5)))


def test_two_publishers_of_one_edge_are_reported(listener, make_node, send, log):
    listener.subscribe(Odometry, 'odometry')
    others = [make_node(name).create_publisher(Odometry, 'odometry', 100)
              for name in ('wheels', 'lidar')]
    until(lambda: all(other.get_subscription_count() for other in others))
    number = 0

    def is_reported():
        nonlocal number
        number += 1
        for other in others:
            other.publish(odometry(1.0 + 0.01 * number))
        return '/lidar' in log() and '/wheels' in log()

    until(is_reported)


def test_a_buffer_that_shows_a_shared_tree_is_not_filled(writer, node, listen):
    buffer = Buffer(shared=True)
    with TransformListener(buffer, node) as listener:
        assert buffer.is_shared
        with pytest.raises(SharedTreeException, match='Buffer.shared=False'):
            listener.subscribe(Odometry, 'odometry')


# --- covariances

def covariance_of(buffer, child='base', seconds=1.5):
    return np.reshape(
        buffer.lookup_uncertain('odom', child, at(seconds)).pose.covariance, (6, 6))


def test_covariances_are_used_on_demand(listener, send):
    listener.subscribe(Odometry, 'odometry', covariances=True)
    send('odometry', odometry())
    np.testing.assert_allclose(covariance_of(until_has(listener)), COVARIANCE)


@pytest.mark.parametrize(('covariance', 'sentence'), [
    (np.zeros((6, 6)), 'it is all zero: the sender did not set it'),
    (-COVARIANCE, 'covariance'),
    (UNKNOWN, 'wider than a full turn')])
@pytest.mark.parametrize('static', [False, True], ids=['moving', 'static'])
def test_a_pose_is_used_although_its_covariance_cannot_be(
        listener, send, log, covariance, sentence, static):
    listener.subscribe(Odometry, 'odometry', covariances=True, static=static)
    send('odometry', odometry(covariance=covariance), qos=static_qos(1) if static else 100)
    buffer = until_has(listener)
    assert buffer.lookup('odom', 'base', at(1.5)) == pytest.approx(TURNED)
    assert buffer.edges()[0].static is static
    assert not covariance_of(buffer).any()
    assert incidents_of(buffer) == {Kind.POSE_ALONE: 1}
    assert (buffer.statistics().accepted, buffer.statistics().refused) == (1, 0)
    until(lambda: sentence in log())


@pytest.mark.parametrize('off_the_floor', [1e6, -1.0, float('nan'), float('inf')])
def test_of_a_robot_on_a_floor_three_variances_are_used(listener, send, off_the_floor):
    listener.subscribe(Odometry, 'odometry', covariances=True, planar=True)
    send('odometry', odometry(covariance=np.diag(
        [1e-4, 1e-4, *3 * [off_the_floor], 1e-4])))
    np.testing.assert_allclose(covariance_of(until_has(listener)),
                               np.diag([1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4]))


def test_a_reader_may_give_a_covariance(listener, send):
    listener.subscribe(String, 'words', lambda message: [
        PoseSample('odom', 'base', at(1.5), TURNED, COVARIANCE),
        PoseSample('odom', 'arm', at(1.5), TURNED)], covariances=True)
    send('words', String(data=''))
    buffer = until_has(listener, 'arm')
    np.testing.assert_allclose(covariance_of(buffer), COVARIANCE)
    assert not covariance_of(buffer, 'arm').any()


def test_of_a_static_topic_the_covariance_is_that_of_the_edge(listener, send):
    listener.subscribe(Odometry, 'mount', static=True, covariances=True)
    send('mount', odometry(), qos=static_qos(1))
    np.testing.assert_allclose(covariance_of(until_has(listener), seconds=7.0), COVARIANCE)
