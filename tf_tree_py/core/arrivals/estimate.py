# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Poses with covariances, as topics beside /tf have them, and the edges that they tell of.

The rules stand here once, for topics that are heard and for topics that were recorded.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .incidents import Incident, Kind
from .sample import checked, Sample
from ..errors import InvalidArgumentException, TransformException
from ..geometry import se3
from ..geometry.covariances import carried, checked_covariance
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array

STATIC_COVARIANCE_TOPIC = '/tf_static_covariance'
"""Where ``static_transform_publisher`` tells of static edges, as Odometry for both frames."""

Edge = tuple[str, str]

# Whether the messages of a type say of which frame they are.
_NAMES_ITS_CHILD = {'nav_msgs/Odometry': True, 'geometry_msgs/PoseWithCovarianceStamped': False}

# With a larger variance than this, radians^2, a rotation is not known at all.
_UNKNOWN = np.pi ** 2
_OFF_THE_FLOOR = [2, 3, 4]


class Estimate(NamedTuple):
    """
    Where a frame is in another at a stamp, and how far that may be off.

    :ivar child: '' where the message does not say it.
    :ivar pose: ``parent_T_child``.
    :ivar covariance: (6, 6), see ``geometry.covariances``; of one that was not judged yet
        (36,) as messages have it.
    """

    parent: str
    child: str
    stamp: int
    pose: PoseTuple
    covariance: Array

    def of(self, other: str, child_T_other: PoseTuple) -> 'Estimate':
        """Return the estimate of another frame, which is fixed to the child."""
        pose = se3.compose(self.pose, child_T_other)
        lever = np.subtract(pose[:3], self.pose[:3])
        return Estimate(self.parent, other, self.stamp, pose,
                        carried(np.eye(3), lever, self.covariance))


@dataclass(frozen=True)
class Covariances:
    """
    To which edge the covariances of a topic belong.

    The messages are Odometry or PoseWithCovarianceStamped. Unless told otherwise, the edge is
    the one between the message's two frames.

    :ivar child: the frame whose pose it is; an odometry names it itself.
    :ivar edge: (parent, child) of another edge that the covariances belong to. An example:
        amcl_pose has the robot's pose in map, but the edge that it is unsure of is
        ('map', 'odom'). The covariance is then moved to where odom's origin is at that time.
        The parent is the message's frame.
    :ivar with_poses: take the pose too, for an edge that is not on ``/tf``.
    :ivar planar: take x, y and the rotation about z only. Drivers of robots on a floor say
        1e6 of the others, which are not unknown but fixed.
    :raises ValueError: arguments that contradict each other.
    """

    child: str | None = None
    edge: Edge | None = None
    with_poses: bool = False
    planar: bool = False

    def __post_init__(self) -> None:
        child, edge = self.child, self.edge
        if not isinstance(child, str | None):
            raise ValueError(f'child is the name of a frame, not {child!r}')
        if edge is None:
            return
        if not isinstance(edge, tuple | list) or len(edge) != 2 or not all(
                isinstance(frame, str) for frame in edge):
            raise ValueError(f"edge is (parent, child), such as ('map', 'odom'), not {edge!r}")
        if self.with_poses:
            raise ValueError('with_poses is for an edge between the two frames of the message, '
                             f'and {edge} is another')

    def check_type(self, type_name: str) -> bool:
        """
        Return whether messages of a type name their child themselves.

        :param type_name: as ROS 2 or ROS 1 writes it, such as ``nav_msgs/msg/Odometry``.
        :raises ValueError: another type, or nobody says of which frame they are.
        """
        names_its_child = _NAMES_ITS_CHILD.get(type_name.replace('/msg/', '/'))
        if names_its_child is None:
            raise ValueError(f'{type_name} is neither Odometry nor PoseWithCovarianceStamped')
        if not (names_its_child or self.child):
            raise ValueError('a PoseWithCovarianceStamped does not say of which frame it is: '
                             "pass child=..., 'base_link' of amcl_pose for instance")
        return names_its_child

    def judged(self, said: Estimate, authority: str) -> Estimate | Incident:
        """
        Return what a message says, checked, or why it cannot be used.

        :param said: as it stands in the message.
        :param authority: who said it.
        """
        sample = checked(Sample(
            said.parent.removeprefix('/'), (self.child or said.child).removeprefix('/'),
            said.stamp, said.pose), authority)
        if isinstance(sample, Incident):
            return sample
        try:
            covariance = checked_covariance(said.covariance)
        except InvalidArgumentException as error:
            return _refused(sample, authority, str(error))
        if self.planar:
            covariance[_OFF_THE_FLOOR] = covariance[:, _OFF_THE_FLOOR] = 0.0
        fault = _fault_of(covariance) or self._fault_of_edge(sample.parent)
        return _refused(sample, authority, fault) if fault else Estimate(*sample, covariance)

    def _fault_of_edge(self, parent: str) -> str:
        if self.edge is None or self.edge[0] == parent:
            return ''
        return f'it is a pose in {parent!r}, and the edge {self.edge} begins elsewhere'

    def carrier(self, estimate: Estimate) -> str | None:
        """Return the frame to whose origin an estimate has to be moved; None: it is there."""
        if self.edge is None or self.edge[1] == estimate.child:
            return None
        return self.edge[1]


def not_moved(estimate: Estimate, frame: str, error: TransformException | None,
              authority: str) -> Incident:
    """Return an incident: the frame that an estimate is to be moved to was nowhere then."""
    return _refused(estimate, authority, f'where {frame!r} was then is not known: {error}')


def _refused(about: Sample | Estimate, authority: str, why: str) -> Incident:
    return Incident(Kind.BAD_COVARIANCE, about.parent, about.child, about.stamp, authority, why)


def _fault_of(covariance: Array) -> str:
    """Return why a covariance says nothing, or ''."""
    if not covariance.any():
        return 'it is all zero: nobody filled it, and the edge stays as sure as it was'
    widest = float(covariance.diagonal()[3:].max())
    if widest > _UNKNOWN:
        return (f'the variance of a rotation is {widest:g} rad^2, more than any angle: so it is '
                'not known at all. Of a robot on a floor take the rest: planar=True')
    return ''
