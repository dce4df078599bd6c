# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The motion of one frame in another one, as measured values and as data for plots."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import Pose, TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .facts import Fact

# The number of evenly spaced stamps, and the greatest number of the frame's own samples, which
# show jumps and gaps.
_EVEN, _OWN = 300, 900


class RelativeMotion(NamedTuple):
    """
    Poses of a frame in another one over time.

    :ivar stamps: (N,) nanoseconds, in order.
    :ivar positions: (N, 3) metres; NaN where there are no data.
    :ivar angles: (N, 3) roll, pitch and yaw, degrees, without jumps by a full turn; NaN where
        there are no data.
    """

    stamps: Stamps
    positions: Array
    angles: Array


def relative_motion(tree: AllQueries, target: str, frame: str, begin: int,
                    end: int) -> RelativeMotion | None:
    """
    Return the motion of a frame in another one between two stamps.

    :return: None: the frames are not connected.
    """
    stamps = _stamps(tree, frame, begin, end)
    try:
        poses, valid = tree.lookup_many(target, frame, stamps, outside='mask')
    except TransformException:
        return None
    positions = np.where(valid[:, None], poses[:, :3], np.nan)
    angles = np.full((len(stamps), 3), np.nan)
    angles[valid] = np.degrees(np.unwrap(
        [Pose(*pose).as_rpy() for pose in poses[valid].tolist()], axis=0)) if valid.any() else 0.0
    return RelativeMotion(stamps, positions, angles)


def _stamps(tree: AllQueries, frame: str, begin: int, end: int) -> Stamps:
    even = np.linspace(begin, end, _EVEN).round().astype(np.int64)
    own = np.asarray(tree.stamps_of(frame) if frame in tree.frames() else [], np.int64)
    own = own[(own >= begin) & (own <= end)]
    # Fewer samples keep the message to the browser short.
    thinned = own[::max(len(own) // _OWN, 1)]
    stamps: npt.NDArray[np.int64] = np.unique(np.concatenate([even, thinned]))
    return stamps[stamps > 0]


def measured(now: Pose | None, motion: RelativeMotion | None) -> list[Fact]:
    """Return measured values between two frames, now and over the window, as facts."""
    if now is None:
        return [('now', 'unknown at this stamp')]
    roll, pitch, yaw = np.degrees(now.as_rpy())
    distance = float(np.linalg.norm(now.translation))
    found = [('distance', f'{distance:.4f} m'),
             ('x, y, z', '{:.4f}, {:.4f}, {:.4f} m'.format(*now.translation)),
             ('roll, pitch, yaw', f'{roll:.2f}, {pitch:.2f}, {yaw:.2f} deg')]
    if motion is None or np.isnan(motion.positions).all():
        return found
    distances = np.linalg.norm(motion.positions, axis=1)
    return [*found, ('distance in the window', _range(distances, '.4f', 'm')),
            ('yaw in the window', _range(motion.angles[:, 2], '.2f', 'deg'))]


def _range(values: Array, form: str, unit: str) -> str:
    return f'{np.nanmin(values):{form}} to {np.nanmax(values):{form}} {unit}'
