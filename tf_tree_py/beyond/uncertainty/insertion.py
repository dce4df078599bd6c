# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Insertion of covariances into a buffer."""

import numpy.typing as npt
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY, PlainBuffer
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import admitted, Sample
from tf_tree_py.core.times import Stamp

from .covariances import checked_covariance
from .edge_covariances import set_covariance
from .edge_estimate import EdgeEstimate


class UncertainBuffer(PlainBuffer):
    """A buffer that takes covariances with transforms."""

    def insert(self, parent: str, child: str, stamp: Stamp, pose: PoseLike, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None,
               covariance: npt.ArrayLike | None = None) -> list[Incident]:
        """
        Insert one transform, and its covariance.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; ignored for static transforms.
        :param static: whether the transform is valid at all times.
        :param strict: True raises an exception if a transform is refused; None issues a Python
            warning, once for each kind; False does neither, for callers that check the returned
            incidents.
        :param covariance: (6, 6) of x, y, z and rotation about x, y, z, metres^2 and
            radians^2, as in ``PoseWithCovariance``: t' = t + dt in the parent's axes,
            R' = Exp(dr) R about the parent's fixed axes through the child's origin. None:
            unknown; the edge keeps its previous covariance.
        :return: the incidents: empty if the transform was inserted without a remark.
        :raises InvalidArgumentException: an invalid stamp, pose or covariance, or a name that
            is not a string.
        :raises RefusedException: with ``strict``, after all valid transforms were inserted.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        if covariance is None:
            return self._refusals.report(self.intake.take([sample], authority, static), strict)
        return self._refusals.report(take_uncertain(
            self.intake, sample, checked_covariance(covariance), authority, static), strict)


def take_uncertain(intake: Intake, sample: Sample, covariance: Array, authority: str,
                   static: bool) -> list[Incident]:
    """Insert a sample and its covariance (6, 6), or neither if one of them is refused."""
    def insert(samples: list[Sample], authority: str, static: bool) -> list[Incident]:
        incidents = intake.insert_each(samples, authority, static)
        if samples and not any(incident.refused for incident in incidents):
            refused = set_covariance(intake.tree, *sample[:3], covariance, authority)
            intake.count(0, refused)
            incidents += refused
        return incidents

    return intake.take([sample], authority, static, insert)


def take_covariance(intake: Intake, parent: str, child: str, stamp: int, covariance: Array,
                    authority: str) -> list[Incident]:
    """Insert the covariance (6, 6) of an edge whose poses are inserted separately."""
    with intake.lock:
        refused = set_covariance(intake.tree, parent, child, stamp, covariance, authority)
        intake.count(0, refused)
    return refused


def take_estimate(intake: Intake, estimate: EdgeEstimate, with_pose: bool,
                  authority: str) -> list[Incident]:
    """Insert an edge's covariance from a topic, and on request its pose too."""
    parent, child, stamp, pose, covariance = estimate
    if with_pose:
        return take_uncertain(
            intake, Sample(parent, child, stamp, pose), covariance, authority, False)
    return take_covariance(intake, parent, child, stamp, covariance, authority)
