# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Corrections of a buffer's edges."""

import math

import numpy.typing as npt
from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.geometry.poses import PoseLike
from tf_tree_py.core.messages.sample import checked_frame
from tf_tree_py.core.times import Stamp

from .absorbing import absorb, Transition
from .arguments import checked_limits, checked_motion, checked_point, DEFAULT_OVER
from .stage import ORIGIN


class CorrectedBuffer(PlainBuffer):
    """A buffer whose edges can be corrected without a jump."""

    def correct(self, child: str, correction: PoseLike, over: int = DEFAULT_OVER, *,
                max_speed: float = math.inf, max_turn_rate: float = math.inf,
                stamp: Stamp | None = None, about: npt.ArrayLike = ORIGIN,
                reach: float = 0.0) -> Transition:
        """
        Correct an edge without a jump: its pose blends to the corrected one.

        When the blend has ended, ``parent_T_child`` is the correction times the inserted pose.
        A correction replaces the previous one. The same correction, point and limits as last
        given for this parent have no effect and return the transition that is in progress. A
        blend begins at the edge's newest sample, so earlier answers stay valid. It begins with
        the current value and rate, so corrections may arrive at any rate, and may be noisy.

        :param correction: any type that ``insert`` accepts as a pose.
        :param over: the minimum duration of a blend from rest, nanoseconds; if a speed is
            limited, at least 0.1 s.
        :param max_speed: the maximum speed that the blend adds to the edge's child, metres per
            second; the blend takes as long as necessary. A lower limit set during a blend
            takes effect after half of ``over``.
        :param max_turn_rate: the same for the rotation, radians per second.
        :param stamp: when the correction was measured, such as the stamp of an image.
            Only ``smoothed()`` uses it. None: the stamp of the newest sample.
        :param about: the point of the child, in its coordinates, that ``max_speed`` holds for
            and that the blend rotates about. A point at a distance of r metres from it may
            additionally gain r times the turn rate.
        :param reach: ``max_speed`` holds for all points up to this distance from ``about``,
            metres. If the edge itself rotates, a point may additionally gain its distance times
            the edge's turn rate times 2 sin(a / 2), with a the angle that remains to be corrected.
        :return: when the blend begins and ends, and the number of the correction.
        :raises InvalidArgumentException: an edge without samples, a static edge or a
            curve; an invalid pose, stamp or limit.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        motion = checked_motion(correction)
        seen_at = None if stamp is None else self._stamp_of(stamp)
        place = checked_point(about)
        with self._lock:
            return absorb(self._tree, checked_frame(child), motion, seen_at, place, limits)
