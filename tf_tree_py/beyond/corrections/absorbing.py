# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Corrections of a tree's edges: absorbing and querying them, in a tree and in a buffer.

``corrected`` moves the samples.
"""

import math
import operator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.messages.sample import checked_frame
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Arrays, Saved

from .blend import BlendLimits
from .corrected import corrected, CorrectedSamples
from .stage import ORIGIN, Stage


class Transition(NamedTuple):
    """
    The transition of an edge to another correction, or to another source.

    :ivar version: how many transitions the buffer has had, including this one.
    :ivar begin: the stamp up to which all results stay the same, nanoseconds.
    :ivar end: the stamp from which the correction is fully applied, nanoseconds.
    :ivar motion: that correction, which applies to the samples as received.
    """

    version: int
    begin: int
    end: int
    motion: Pose


class Transitions(Companion):
    """
    The number of transitions of all edges to another correction or source.

    :ivar count: it never decreases.
    """

    key = 'corrections'

    def __init__(self, count: int = 0) -> None:
        self.count = count

    def copy(self) -> 'Transitions':
        """Return a copy."""
        return Transitions(self.count)

    def save(self, arrays: Arrays) -> int:
        """Return the number."""
        return self.count

    @classmethod
    def load(cls, saved: Saved) -> 'Transitions':
        """Return the saved number."""
        return cls(saved.whole(cls.key))


def transition(tree: Tree, stage: Stage, *, is_new: bool = True) -> Transition:
    """Return the transition of a stage; count it if it is new."""
    transitions = tree.companion_or_new(Transitions)
    transitions.count += is_new
    return Transition(transitions.count, stage.begin, stage.end, Pose._make(stage.motion))


# --- callers' arguments

DEFAULT_OVER = from_seconds(0.5)


def _checked_motion(correction: PoseLike) -> PoseTuple:
    """
    Return a caller's correction as a pose.

    :raises InvalidArgumentException: not a pose, or not finite.
    """
    motion = checked_pose(correction)
    if not all(map(math.isfinite, motion)):
        raise InvalidArgumentException('Invalid argument correction: it is not finite')
    return motion


def checked_limits(over: int, max_speed: float, max_turn_rate: float, reach: float) -> BlendLimits:
    """
    Return a caller's limits of a blend.

    :raises InvalidArgumentException: negative, not a number, or a blend that would never end.
    """
    try:
        span = operator.index(over)
        fast, turn, near = float(max_speed), float(max_turn_rate), float(reach)
    except (TypeError, ValueError):
        raise InvalidArgumentException(
            f'over={over!r} must be integer nanoseconds, and max_speed={max_speed!r}, '
            f'max_turn_rate={max_turn_rate!r} and reach={reach!r} numbers') from None
    if not (span >= 0 and fast > 0.0 and turn > 0.0 and 0.0 <= near < math.inf):
        raise InvalidArgumentException(
            f'over={over!r} ns must not be negative, max_speed={max_speed!r} and '
            f'max_turn_rate={max_turn_rate!r} must be positive, and reach={reach!r} metres '
            'must be finite and not negative')
    return BlendLimits(span, fast, turn, near)


def _checked_point(given: npt.ArrayLike) -> Vector3:
    """
    Return the point of the child whose speed a caller limits.

    :raises InvalidArgumentException: it is not a point, or not finite.
    """
    if given is ORIGIN:
        return ORIGIN  # the usual case
    try:
        x, y, z = np.asarray(given, dtype=float).tolist()
    except (TypeError, ValueError):
        raise InvalidArgumentException(f'about must be a point (3,), not {given!r}') from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InvalidArgumentException(f'about must be a finite point (3,), not {given!r}')
    return (x, y, z)


# --- corrections of a buffer

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
        motion = _checked_motion(correction)
        seen_at = None if stamp is None else self._stamp_of(stamp)
        place, child = _checked_point(about), checked_frame(child)
        with self._lock:
            history = corrected(self._tree.histories.get(child), child)
            if seen_at is not None and history.newest_stamp is not None:
                _check_seen(seen_at, history.newest_stamp)
            self._tree.replace(history)
            before = history.stage()
            stage = history.absorb(motion, seen_at, place, limits)
            return transition(self._tree, stage, is_new=stage is not before)


def _check_seen(seen_at: int, newest: int) -> None:
    if seen_at > newest:
        raise InvalidArgumentException(
            f'Invalid argument stamp {seen_at}: the correction cannot have been seen after the '
            f"edge's newest sample, {newest}")


# --- queries

class CorrectionQueries(Queries):
    """The corrections of edges, thread-safe."""

    @property
    def corrections_version(self) -> int:
        """Return the number of corrections and switches so far; it never decreases."""
        transitions = self._tree.companion(Transitions)
        return 0 if transitions is None else transitions.count

    def correction_of(self, child: str) -> Pose:
        """
        Return the newest correction of an edge, even while it is in transition to it.

        After the transition, ``parent_T_child`` is this correction times the inserted pose.
        Without corrections it is the identity.
        """
        with self._lock:
            history = self._tree.histories.get(child)
            stage = history.stage() if isinstance(history, CorrectedSamples) else None
            return Pose._make(se3.IDENTITY if stage is None else stage.motion)

    def _smoothed(self) -> Tree:
        """Return a copy of the tree with all corrections applied to the past, too."""
        twin = self._tree.copy()
        for history in list(twin.histories.values()):
            if isinstance(history, CorrectedSamples):
                twin.replace(history.smoothed())
        return twin
