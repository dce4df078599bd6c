"""
Copies of edges' histories, for many stamps: each kind with its own evaluation.

Made under the buffer's lock, and used without it.
"""

import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Stamps


class EdgeTrack(Protocol):
    """
    One edge from a first to a last stamp.

    :ivar knots: (n,) sorted stamps; between two neighbours the edge moves smoothly. None
        where it never moves.
    """

    knots: Stamps

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses some time after stamps.

        :param stamps: (...) nanoseconds.
        :param since: (...) nanoseconds after them, no further than the next knot, which is
            then approached from below; None: none.
        :return: (..., 7), or (7,) where it never moves.
        """

    @property
    def reach(self) -> float:
        """Return how far the child is away at most, metres."""

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return how much it moves from one stamp to the next, at most.

        What the error of an interpolating polynomial is judged by: it holds for motion at
        a constant speed between knots. A kind that moves otherwise returns infinity, and
        is then evaluated at every stamp.

        :param knots: (n,) sorted, n > 1; its own between the first and the last are among
            them.
        :return: the angle, radians, and the distance, metres.
        """


class ConstantTrack:
    """An edge that never moves."""

    knots: Stamps = np.empty(0, dtype=np.int64)

    def __init__(self, pose: PoseTuple) -> None:
        self._pose = np.array(pose)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the pose (7,)."""
        return self._pose

    @property
    def reach(self) -> float:
        """Return how far the child is away, metres."""
        return math.hypot(*self._pose[:3])

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return that it does not move."""
        return 0.0, 0.0


class HeldTrack:
    """
    Samples that each hold until the next.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, knots: Stamps, poses: Array) -> None:
        self.knots = knots
        self._poses = poses

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (..., 7) of the samples that hold at stamps."""
        return self._poses.take(self._before(stamps), axis=0)

    @property
    def reach(self) -> float:
        """Return how far the child is away at most, metres."""
        return float(np.linalg.norm(self._poses[:, :3], axis=1).max())

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return that nothing moves between two samples."""
        return 0.0, 0.0

    def _before(self, stamps: Stamps) -> npt.NDArray[np.intp]:
        """Return the index of the last sample at or before each stamp."""
        return np.searchsorted(self.knots, stamps, side='right') - 1


class InterpolatedTrack(HeldTrack):
    """
    Samples between which the edge goes straight and turns at a constant speed.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, knots: Stamps, poses: Array) -> None:
        # The last sample once more, so that it too has a successor.
        super().__init__(knots, np.concatenate([poses, poses[-1:]]))
        lengths = np.diff(knots, append=knots[-1:])
        self._inverse_lengths = np.divide(1.0, lengths, where=lengths > 0,
                                          out=np.zeros(len(knots)))

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (..., 7) between the samples before and after."""
        before = self._before(stamps)
        elapsed: Array = (stamps - self.knots[before]).astype(float)
        if since is not None:
            elapsed = elapsed + since
        ratios = elapsed * self._inverse_lengths[before]
        return se3.interpolate_many(
            self._poses[before], self._poses[before + 1], ratios, as_tf2=True)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return the greatest angle and distance between two neighbouring knots."""
        before, lengths = self._before(knots[:-1]), np.diff(knots)
        turning, going = self._speeds()
        return (float((turning[before] * lengths).max()),
                float((going[before] * lengths).max()))

    def _speeds(self) -> tuple[Array, Array]:
        """Return how fast it turns and goes after each sample, radians and metres a ns."""
        rotations = self._poses[:, 3:]
        cosines = np.abs(np.einsum('ij,ij->i', rotations[:-1], rotations[1:]))
        turns = 2.0 * np.arccos(np.minimum(cosines, 1.0))
        steps = np.linalg.norm(np.diff(self._poses[:, :3], axis=0), axis=1)
        return turns * self._inverse_lengths, steps * self._inverse_lengths
