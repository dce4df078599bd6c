# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the nodes that publish one edge share: messages as samples of it, and parameters.

Messages of several types are converted. The parameters are those of an edge that blends without
jumps.
"""

from collections.abc import Iterator
from typing import get_args, TypeAlias

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage
from tf_tree_py.beyond.corrections.blend import BlendLimits
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import checked, impossible_stamp, Sample
from tf_tree_py.core.stamp import from_seconds, LATEST
from tf_tree_py.ros.messages.convert import as_nanoseconds, as_sample

from .bad_input import BadInput
from .parameters import Setting, Values

LIMITS = (
    Setting('max_speed', 0.2, 'how fast a blend may move the frame, in addition to its own '
            'motion, m/s', (1e-6, 1e6)),
    Setting('max_turn_rate', 0.1, 'how fast a blend may turn the frame, rad/s', (1e-6, 1e6)),
    Setting('over', 0.3, 'the shortest duration of a blend, seconds', (0.0, 3600.0)),
)


def limits_of(values: Values) -> BlendLimits:
    """Return the limits of the blend, from the parameters in ``LIMITS``."""
    return BlendLimits(
        from_seconds(values['over']), values['max_speed'], values['max_turn_rate'], 0.0)


def frame_of(values: Values, key: str) -> str:
    """
    Return the frame that a parameter names, without a leading slash.

    :raises BadInput: it is not the name of a frame.
    """
    name: str = values[key].removeprefix('/')
    if not name:
        raise BadInput(f'parameter {key} must be the name of a frame')
    return name


# --- messages

EdgePose: TypeAlias = (
    Odometry | PoseStamped | PoseWithCovarianceStamped | TransformStamped | TFMessage)
TYPES = {cls.__name__: cls for cls in get_args(EdgePose)}


def message_type(name: str) -> type[EdgePose]:
    """
    Return the type of a name such as ``nav_msgs/msg/Odometry``, or ``Odometry``.

    :raises BadInput: it is not one of ``TYPES``.
    """
    cls = TYPES.get(name.rpartition('/')[2])
    if cls is None:
        raise BadInput(f'{name!r} is not a type of message with the pose of an edge; use one of '
                       f'{", ".join(TYPES)}')
    return cls


def samples_of(message: EdgePose, parent: str, child: str) -> Iterator[Sample]:
    """
    Yield the samples of an edge in a message.

    Other edges of a TFMessage are skipped; a message without a child is assumed to be of this
    edge.

    :raises InvalidArgumentException: the message is of another edge, has no stamp, or has an
        invalid stamp or pose.
    """
    if isinstance(message, TFMessage):
        for transform in message.transforms:
            sample = as_sample(transform)
            if (sample.parent, sample.child) == (parent, child):
                yield _sound(sample, transform)
        return
    sample = as_sample(message) if isinstance(message, TransformStamped) else _of_pose(message)
    if (sample.parent, sample.child or child) != (parent, child):
        raise InvalidArgumentException(
            f'its edge is {sample.parent!r} -> {sample.child or child!r}, not {parent!r} -> '
            f'{child!r}')
    yield _sound(sample._replace(child=child), message)


def _of_pose(message: Odometry | PoseStamped | PoseWithCovarianceStamped) -> Sample:
    pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
    p, q = pose.position, pose.orientation
    return Sample(message.header.frame_id.removeprefix('/'),
                  getattr(message, 'child_frame_id', '').removeprefix('/'),
                  as_nanoseconds(message.header.stamp), (p.x, p.y, p.z, q.x, q.y, q.z, q.w))


def _sound(sample: Sample, message: EdgePose) -> Sample:
    if sample.stamp == LATEST:
        raise InvalidArgumentException('it has no stamp, so its time is unknown')
    impossible = impossible_stamp(message)
    found = checked(sample, '') if impossible is None else impossible.incident('')
    if isinstance(found, Incident):
        raise InvalidArgumentException(f'{found.kind.value}: {found.detail}')
    return found
