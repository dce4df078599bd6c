# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Convert messages with observations to numbers, those of rclpy as well as of rosbags.

Observations in a bag are read without ROS: from topics, and from frames on /tf.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.bag import Bag, Recording
from tf_tree_py.bag.files.connections import decode
from tf_tree_py.core import TransformException
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.sample import message_stamp

from .chain import Tree
from .observations import Array, CalibrationError, Observations

_NO_POSES = 'apriltag_msgs/msg/AprilTagDetectionArray'


class Detection(NamedTuple):
    """
    One observation of one target.

    :ivar sensor: the frame of the header.
    :ivar target: its name; '' if the message has none.
    :ivar seen: a pose (7,) or a point (3,).
    :ivar covariance: (36,), or None.
    """

    stamp: int
    sensor: str
    target: str
    seen: tuple[float, ...]
    covariance: Array | None = None


def detections_in(type_name: str, message: Any) -> list[Detection]:
    """
    Return the observations in a message.

    :param type_name: such as ``geometry_msgs/msg/PoseStamped``.
    :raises CalibrationError: messages of this type carry no observations.
    """
    check_type(type_name)
    found = list(_READERS[type_name](message))
    # The detections of an array may have empty headers.
    return [each if each.sensor else each._replace(
        stamp=message_stamp(message), sensor=message.header.frame_id) for each in found]


def check_type(type_name: str) -> None:
    """
    Check that messages of a type carry observations.

    :raises CalibrationError: they do not; the error lists the types that do.
    """
    if type_name == _NO_POSES:
        raise CalibrationError(
            f'{type_name} has the tags in pixels, not in metres. Its node publishes the frames of '
            'the tags on /tf, so use --observations tf:FRAME_OF_THE_TAG')
    if type_name not in _READERS:
        raise CalibrationError(f'{type_name} carries no observations; these types do: '
                               f'{", ".join(sorted(_READERS))}')


def gathered(detections: Iterable[Detection], fixed_in: str, known: dict[str, str],
             topic: str) -> list[Observations]:
    """
    Return one set of observations for each sensor and target.

    :param fixed_in: the frame in which targets rest.
    :param known: the frames of targets whose place is in the tree, by target; '' is the default.
    :param topic: the name for targets that have none.
    """
    sets: dict[tuple[str, str], list[Detection]] = {}
    for each in detections:
        named = each._replace(sensor=each.sensor.removeprefix('/'), target=each.target or topic)
        sets.setdefault((named.sensor, named.target), []).append(named)
    return [_observations(found, known.get(found[0].target, known.get('', '')), fixed_in)
            for found in sets.values()]


def _observations(found: list[Detection], frame: str, fixed_in: str) -> Observations:
    seen = np.array([each.seen for each in found])
    size = 6 if seen.shape[1] == 7 else 3
    covariances = [each.covariance for each in found]
    given = all(each is not None and np.any(each) for each in covariances)
    place = np.array([0.0, 0, 0, 0, 0, 0, 1.0][:seen.shape[1]]) if frame else None
    return Observations(
        found[0].sensor, np.array([each.stamp for each in found], dtype=np.int64), seen,
        frame or fixed_in, found[0].target, place,
        np.array(covariances, dtype=float).reshape(-1, size, size) if given else None)


def _numbers(pose: Any) -> tuple[float, ...]:
    p, q = pose.position, pose.orientation
    length = float(np.linalg.norm((q.x, q.y, q.z, q.w)))
    if length < 1e-6:  # the node never filled in the pose
        return (float('nan'),) * 7
    return (p.x, p.y, p.z, q.x / length, q.y / length, q.z / length, q.w / length)


def _seen(message: Any, target: str, seen: tuple[float, ...],
          covariance: npt.ArrayLike | None = None) -> Detection:
    return Detection(message_stamp(message), message.header.frame_id, target, seen,
                     None if covariance is None else np.asarray(covariance))


def _uncertain(message: Any, target: str = '') -> Detection:
    return _seen(message, target, _numbers(message.pose.pose), message.pose.covariance)


def _box(message: Any) -> Detection:
    """Return an object of vision_msgs, from its best hypothesis or its box."""
    if not message.results:
        return _seen(message, message.id, _numbers(message.bbox.center))
    best = max(message.results, key=lambda each: each.hypothesis.score)
    return _seen(message, message.id or best.hypothesis.class_id, _numbers(best.pose.pose),
                 best.pose.covariance)


def _name_of(tag: npt.ArrayLike) -> str:
    """Return the name of a tag of apriltag_ros, which may be several, or of isaac_ros_apriltag."""
    return 'tag ' + '+'.join(map(str, np.atleast_1d(np.asarray(tag)).tolist()))


_READERS: dict[str, Callable[[Any], Iterable[Detection]]] = {
    'geometry_msgs/msg/PoseStamped': lambda message: [
        _seen(message, '', _numbers(message.pose))],
    'geometry_msgs/msg/PoseWithCovarianceStamped': lambda message: [_uncertain(message)],
    'geometry_msgs/msg/PoseArray': lambda message: [
        _seen(message, '' if len(message.poses) == 1 else f'pose {number}', _numbers(pose))
        for number, pose in enumerate(message.poses)],
    'geometry_msgs/msg/PointStamped': lambda message: [
        _seen(message, '', (message.point.x, message.point.y, message.point.z))],
    'vision_msgs/msg/Detection3D': lambda message: [_box(message)],
    'vision_msgs/msg/Detection3DArray': lambda message: map(_box, message.detections),
} | dict.fromkeys(
    ('apriltag_ros/msg/AprilTagDetectionArray',
     'isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray'),
    lambda message: [_uncertain(tag.pose, _name_of(tag.id)) for tag in message.detections])
TYPES = tuple(_READERS)
"""The types of messages that carry observations."""


# --- in a bag

FRAME = 'tf:'
"""The prefix of a target that is a frame on /tf."""


def recorded_observations(recording: Recording, names: Sequence[str], fixed_in: str,
                          known: dict[str, str]) -> list[Observations]:
    """
    Return the observations in a recording.

    :param recording: the result of ``open_bag``.
    :param names: topics, and ``tf:FRAME`` for targets whose frames are on /tf.
    :param fixed_in: the frame in which targets rest.
    :param known: the frames of targets whose place is in the tree, by target; '' is the default.
    :raises CalibrationError: the bag lacks a topic or a frame, or a topic has the wrong type.
    :raises BagError: the bag cannot be read.
    """
    sets: list[Observations] = []
    for name in names:
        if name.startswith(FRAME):
            sets.append(seen_on_tf(recording, name.removeprefix(FRAME), fixed_in, known))
        else:
            sets += gathered(_on_topic(recording, name), fixed_in, known, name)
    return sets


def seen_on_tf(tree: Tree, frame: str, fixed_in: str, known: dict[str, str]) -> Observations:
    """
    Return the samples of a target's frame as observations by the parent frame.

    :raises CalibrationError: the frame does not exist, or is static.
    """
    edge = next((edge for edge in tree.edges() if edge.child == frame), None)
    if edge is None:
        raise CalibrationError(f'the frame {frame!r} was never seen: nothing on /tf has it as a '
                               'child')
    if edge.static:
        raise CalibrationError(f'{edge.parent} -> {frame} is static, so it is not an '
                               'observation by a sensor')
    stamps = tree.stamps_of(frame)
    try:
        poses, _ = tree.lookup_many(edge.parent, frame, stamps, outside='mask')
    except TransformException as error:
        raise CalibrationError(str(error)) from error
    place = known.get(frame, known.get('', ''))
    return Observations(edge.parent, stamps, np.asarray(poses), place or fixed_in, frame,
                        (0.0, 0, 0, 0, 0, 0, 1) if place else None)  # type: ignore[arg-type]


def _on_topic(recording: Recording, topic: str) -> list[Detection]:
    with Bag(recording.path, []) as bag:
        topics = {each.topic: each.type_name for each in sorted(
            bag.everything, key=lambda each: each.is_of_ros)}
        if topic not in topics:
            there = [f'{name} ({type_name})' for name, type_name in sorted(topics.items())]
            raise CalibrationError(f'{recording.path} has no topic {topic}; it has: '
                                   f'{", ".join(there) or "nothing"}')
        check_type(topics[topic])
        found: list[Detection] = []
        for arrival in bag.messages(topic):
            connection = arrival.connection
            try:
                message = decode(connection, arrival.data)
            except WireError:
                continue  # a damaged message observes nothing
            found += detections_in(connection.type_name, message)
        return found
