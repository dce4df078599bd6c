"""
One lookup at many stamps, in numpy.

Each moving edge on the path is copied out of its history (under the lock) as
an ``EdgeTrack``; everything else happens here, without it. Two ways lead to the
same poses, to rounding:

- directly: interpolate every edge at every stamp, and compose;
- through polynomials, when there are many more stamps than samples: between two
  neighbouring samples of all edges every edge moves at constant velocity, so the
  composed pose is a smooth function of time, and the polynomial through a few of
  its values is that function to rounding. Its cost does not depend on the depth of
  the path.
"""

from collections.abc import Sequence
import math

import numpy as np
import numpy.typing as npt

from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Stamps

# Stamps handled at once by the direct way: its temporaries stay small and in the cache.
_BLOCK = 8192
# What a polynomial may deviate from the function, beyond what its numbers are rounded by.
_TOLERANCE = 5e-13
_ROUNDING = 2.0 ** -52
# With more, the powers of a polynomial would lose more than it gains.
_MAX_NODES = 7


class EdgeTrack:
    """
    A copy of one moving edge's samples.

    :ivar stamps: (n,) nanoseconds, sorted.
    :ivar poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, stamps: Stamps, poses: Array) -> None:
        # The last sample once more, so that it too has a successor.
        self.stamps = stamps
        self._poses = np.concatenate([poses, poses[-1:]])
        lengths = np.diff(stamps, append=stamps[-1:])
        self._inverse_lengths = np.divide(1.0, lengths, where=lengths > 0,
                                          out=np.zeros(len(stamps)))

    def at(self, samples: npt.NDArray[np.intp], since: Array) -> Array:
        """
        Return the poses so many nanoseconds after samples, towards the next ones.

        :param samples: (...) indices.
        :param since: (...) nanoseconds.
        :return: (..., 7)
        """
        ratios = since * self._inverse_lengths[samples]
        return se3.interpolate_many(
            self._poses[samples], self._poses[samples + 1], ratios, as_tf2=True)

    @property
    def reach(self) -> float:
        """Return how far the child is away at most, metres."""
        return float(np.linalg.norm(self._poses[:, :3], axis=1).max())

    def speeds(self) -> tuple[Array, Array]:
        """Return how fast the edge turns and goes after each sample, radians and metres a ns."""
        rotations = self._poses[:, 3:]
        cosines = np.abs(np.einsum('ij,ij->i', rotations[:-1], rotations[1:]))
        turns = 2.0 * np.arccos(np.minimum(cosines, 1.0))
        steps = np.linalg.norm(np.diff(self._poses[:, :3], axis=0), axis=1)
        return turns * self._inverse_lengths, steps * self._inverse_lengths


Part = EdgeTrack | PoseTuple
"""An edge on the path: moving, or static (some of these composed)."""


class PathTrack:
    """
    The edges between two frames, copied, to be composed at many stamps.

    :param source_parts: from the meeting point down to the source.
    :param target_parts: from the meeting point down to the target.
    """

    def __init__(self, source_parts: Sequence[Part], target_parts: Sequence[Part]) -> None:
        self._source_parts = source_parts
        self._target_parts = target_parts
        self._moving = [part for part in (*source_parts, *target_parts)
                        if isinstance(part, EdgeTrack)]

    def poses_at(self, stamps: Stamps) -> Array:
        """
        Return ``target_T_source`` at stamps that all edges have data for.

        :param stamps: (N,) nanoseconds, in any order.
        :return: (N, 7)
        """
        if not len(stamps):
            return np.empty((0, 7))
        if not self._moving:
            return np.tile(self._compose([]), (len(stamps), 1))
        first, last = stamps.min(), stamps.max()
        knots = np.unique(np.concatenate([
            [first, last], *(edge.stamps for edge in self._moving)]))
        knots = knots[(knots >= first) & (knots <= last)]
        nodes = self._nodes_needed(knots)
        if nodes and len(knots) > 1 and len(stamps) > 2 * nodes * len(knots):
            return self._through_polynomials(stamps, knots, nodes)
        return self._directly(stamps)

    def _directly(self, stamps: Stamps) -> Array:
        poses = np.empty((len(stamps), 7))
        for begin in range(0, len(stamps), _BLOCK):
            block = stamps[begin:begin + _BLOCK]
            poses[begin:begin + _BLOCK] = self._compose_after(block, np.zeros(len(block)))
        return poses

    def _through_polynomials(self, stamps: Stamps, knots: Stamps, nodes: int) -> Array:
        """Return the poses by way of the interpolating polynomials between the knots."""
        # Chebyshev's second kind on 0 to 1: the ends are among them.
        places = 0.5 - 0.5 * np.cos(np.pi * np.arange(nodes) / (nodes - 1))
        lengths = np.diff(knots).astype(float)
        values = self._compose_after(knots[:-1, None], lengths[:, None] * places)
        # Coefficients of the powers of 0 to 1, highest first. Only the change since the knot
        # goes through the ill-conditioned inverse.
        to_powers = np.linalg.inv(np.vander(places))
        coefficients = np.einsum('pn,snc->psc', to_powers, values - values[:, :1])
        coefficients[-1] = values[:, 0]
        poses = np.empty((len(stamps), 7))
        for begin in range(0, len(stamps), _BLOCK):
            block = stamps[begin:begin + _BLOCK]
            pieces = np.searchsorted(knots[1:-1], block, side='right')
            places = ((block - knots[pieces]) / lengths[pieces])[:, None]
            block_poses = coefficients[0].take(pieces, axis=0)
            for coefficient in coefficients[1:]:
                block_poses *= places
                block_poses += coefficient.take(pieces, axis=0)
            poses[begin:begin + _BLOCK] = block_poses
        # The last piece leads to the first of several samples there; the last one counts.
        at_end = stamps == knots[-1]
        if at_end.any():
            poses[at_end] = self._directly(knots[-1:])
        return poses

    def _nodes_needed(self, knots: Stamps) -> int:
        """
        Return how many values fix the curve between two knots to rounding; 0 for too many.

        A function deviates from its interpolation at n Chebyshev nodes on an interval
        of one by at most 2 |f^(n)| / (4^n n!). Where all edges together turn by an angle a,
        go a distance d, and reach r metres, |f^(n)| <= max(1, r) a^n + n d a^(n-1).
        """
        if len(knots) < 2:
            return 0
        lengths = np.diff(knots)
        angle = distance = 0.0
        for edge in self._moving:
            samples = _samples_before(edge, knots[:-1])
            turning, going = edge.speeds()
            angle += float((turning[samples] * lengths).max())
            distance += float((going[samples] * lengths).max())
        reach = sum(map(_reach, (*self._source_parts, *self._target_parts)))
        tolerance = _TOLERANCE + _ROUNDING * reach
        for nodes in range(3, _MAX_NODES + 1):
            derivative = (max(1.0, reach) * angle ** nodes
                          + nodes * distance * angle ** (nodes - 1))
            if 2.0 * derivative / (4.0 ** nodes * math.factorial(nodes)) < tolerance:
                return nodes
        return 0

    def _compose_after(self, stamps: Stamps, since: Array) -> Array:
        """Return the poses at times that begin at stamps and lie before the next knot."""
        return self._compose([
            edge.at(samples, (stamps - edge.stamps[samples]) + since)
            for edge in self._moving
            for samples in [_samples_before(edge, stamps)]
        ])

    def _compose(self, moving: list[Array]) -> Array:
        """Return inverse(top_T_target) top_T_source, given the poses of the moving edges."""
        at_hand = iter(moving)

        def branch(parts: Sequence[Part]) -> Array:
            product = np.array(se3.IDENTITY)
            for number, part in enumerate(parts):
                pose = next(at_hand) if isinstance(part, EdgeTrack) else np.array(part)
                product = se3.compose_many(product, pose) if number else pose
            return product

        top_T_source = branch(self._source_parts)
        if not self._target_parts:
            return top_T_source
        return se3.compose_many(se3.inverse_many(branch(self._target_parts)), top_T_source)


def _reach(part: Part) -> float:
    """Return how far an edge's child is away at most, metres."""
    return part.reach if isinstance(part, EdgeTrack) else math.hypot(*part[:3])


def _samples_before(edge: EdgeTrack, stamps: Stamps) -> npt.NDArray[np.intp]:
    return np.searchsorted(edge.stamps, stamps, side='right') - 1
