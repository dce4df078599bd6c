"""
One transform as it arrives, before it is let into the tree.

The wire, a message and a caller all end up here, so the checks of tf2 stand
once: names, NaN, quaternions.
"""

import math
from typing import NamedTuple

from . import so3
from .incidents import Incident, Kind
from .se3 import PoseTuple

# A quaternion whose squared length is within this of one is taken as it is.
_UNIT_TOLERANCE = 1e-12


class Sample(NamedTuple):
    """``parent_T_child`` at a stamp in nanoseconds; nothing is checked yet."""

    parent: str
    child: str
    stamp: int
    pose: PoseTuple


def checked(sample: Sample, authority: str) -> Sample | Incident:
    """
    Return a sample fit for the tree, or why there is none.

    Strips one leading slash of each name and normalises the quaternion, as tf2
    does; refuses what tf2 refuses, and infinities, which would become NaN on the
    first composition.
    """
    parent, child, stamp, pose = sample
    x, y, z, qx, qy, qz, qw = pose
    # NaN and infinity fail this comparison too.
    excess = qx * qx + qy * qy + qz * qz + qw * qw - 1.0 + 0.0 * (x + y + z)
    plain = -_UNIT_TOLERANCE < excess < _UNIT_TOLERANCE
    if plain and parent != child and parent and child and parent[0] != '/' != child[0]:
        return sample
    stripped = Sample(parent.removeprefix('/'), child.removeprefix('/'), stamp, pose)
    return _mended(stripped, authority)


def _mended(sample: Sample, authority: str) -> Sample | Incident:
    parent, child, stamp, pose = sample

    def refused(kind: Kind, detail: str) -> Incident:
        return Incident(kind, parent, child, stamp, authority, detail)

    if not parent or not child:
        missing = 'child_frame_id' if not child else 'header.frame_id'
        return refused(Kind.EMPTY_FRAME, f'{missing} is not set')
    if parent == child:
        return refused(Kind.SELF_EDGE, 'frame_id and child_frame_id are the same')
    if not all(map(math.isfinite, pose)):
        return refused(Kind.NOT_FINITE, f'(x y z, qx qy qz qw) = {pose}')
    x, y, z, qx, qy, qz, qw = pose
    if not (qx or qy or qz or qw):
        return refused(Kind.ZERO_ROTATION, 'a message that nobody filled? No rotation is 0 0 0 1')
    return Sample(parent, child, stamp, (x, y, z, *so3.normalize((qx, qy, qz, qw))))
