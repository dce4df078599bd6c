# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The noise of an edge's samples, learnt from the samples.

A motion is smooth, and noise is not: what a polynomial through the samples around one does not
explain is noise (Gasser, Sroka, Jennen-Steinmetz, "Residual variance and residual pattern in
nonlinear regression", Biometrika 73(3), 1986). The residual is a divided difference: the
combination of some successive samples that is zero for every polynomial of a lower degree,
divided by the root of the sum of its squared weights; so its variance is that of one sample.

Only noise that is independent from sample to sample shows in this way. Errors that last for
several samples, such as those of a filter, look like a motion.
"""

from bisect import bisect_left, bisect_right
from math import degrees
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.interpolation import is_linear, LINEAR
from tf_tree_py.core.edges.packed import POSE_FLOATS
from tf_tree_py.core.edges.protocol import moves, MovingHistory
from tf_tree_py.core.errors import ExtrapolationException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Number
from tf_tree_py.core.stamp import as_seconds, BEGINNING, LATEST
from tf_tree_py.core.times import Mask, Stamps
from tf_tree_py.core.tree.path import sample_of, Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_history import closing_of, known_covariances
from .covariances import (
    DIAGONAL,
    errors_of,
    largest_deviation,
    one_term,
    pack,
    PACKED_FLOATS,
    packed_squares,
    unpack,
    with_less_correlation,
)
from .learning import (
    Cells,
    changes,
    check_size,
    chosen,
    LATELY,
    Learnt,
    parent_since,
    Span,
    span_of,
    stamps_in,
    Sums,
    sums_by_cell,
)
from .propagation import steps_between
from .uncertain import EdgeErrors

# The degrees of the polynomials, plus one. The lower one uses the samples better; the higher one
# is for motions that are fast for the rate of the samples.
_ORDERS = (4, 6)
# The higher order counts if the variance along an axis is smaller than this part.
_SMALLER = 0.8
# Sums: of all residuals of the lower order, of those at whose place there is one of the higher
# order, too, and of these.
_PARTS = 3
# With fewer residuals the noise is unknown.
_LEAST = 8
# Successive residuals have samples in common: so many count as one.
_ALIKE = 2.6
# Correlations are those of so many more residuals that show none.
PRIOR = 6.0
# From n independent residuals, a variance is enlarged by 5 / n: if it is too small for some axes,
# the errors along these count for more than they do less along the others.
_FEW = 5.0
# Longer gaps, relative to the median of those around, say nothing about noise.
_LONGEST_GAP = 4.0


class EdgeNoise(NamedTuple):
    """
    The noise of the samples of an edge.

    :ivar covariance: (6, 6) of x, y, z and the rotation about x, y, z, metres^2 and radians^2, in
        the axes of the child, about its origin; read-only. Zeros for a curve, which is exact.
    :ivar trials: how many residuals it was learnt from; 0 for a curve.
    """

    covariance: Array
    trials: int

    @property
    def position_sigma(self) -> float:
        """Return the standard deviation of the position in its worst direction, metres."""
        return largest_deviation(self.covariance[:3, :3])

    @property
    def rotation_sigma(self) -> float:
        """Return the standard deviation of the rotation about its worst axis, radians."""
        return largest_deviation(self.covariance[3:, 3:])

    def as_dict(self) -> dict[str, object]:
        """Return it as plain data."""
        return {'sigma_m': self.position_sigma, 'sigma_deg': degrees(self.rotation_sigma),
                'trials': self.trials}


class SampleNoise:
    """The noise of one edge's samples, which may be cached; see ``learning``."""

    __slots__ = ('_since', '_cells', '_known', '_found')

    def __init__(self, history: MovingHistory, since: int | None = None) -> None:
        self._since = parent_since(history) if since is None else since
        self._cells = Cells()
        # The cells that are known, and the answer.
        self._known: tuple[int, int, int] | None = None
        self._found: EdgeNoise | None = None

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all that a late sample may have changed."""
        self._cells.forget(late)
        self._known = None

    def at(self, history: MovingHistory, newest: int) -> tuple[Span, EdgeNoise | None]:
        """
        Return the time that counts, and the noise; None if there are too few samples.

        :param newest: the stamp of the newest sample.
        """
        span = span_of(history, newest, self._since)
        if not history.takes_samples:
            return span, _OF_CURVE
        first, last = -(-span.oldest // span.cell), span.newest // span.cell - 1
        if (span.cell, first, last) != self._known:
            last = min(last, _settled(history) // span.cell - 1)
        if (span.cell, first, last) != self._known:
            rows = self._cells.rows(span.cell, first, last, lambda begin, end: _residuals(
                history, span, begin, end))
            self._found = _noise_of(rows.sum(axis=0)) if len(rows) else None
            self._known = span.cell, first, last
        return span, self._found


def _constant(covariance: Array, trials: int) -> EdgeNoise:
    """Return a noise that callers cannot change: it is cached, and compared by its identity."""
    covariance.setflags(write=False)
    return EdgeNoise(covariance, trials)


# A curve is exact.
_OF_CURVE = _constant(np.zeros((6, 6)), 0)


def _noise_of(sums: Array) -> EdgeNoise | None:
    """Return the noise that the sum of all rows shows; None if there are too few residuals."""
    all_of_lower, lower, higher = sums[1:].reshape(_PARTS, 1 + PACKED_FLOATS)
    if all_of_lower[0] < _LEAST:
        return None
    found = unpack(all_of_lower[1:] / all_of_lower[0])
    if higher[0] >= _LEAST:
        # A motion that the lower order does not explain adds to its residuals.
        before = np.maximum(lower[1:][DIAGONAL], np.finfo(float).tiny)
        part = higher[1:][DIAGONAL] / before
        factor = np.sqrt(np.where(part < _SMALLER, part, 1.0))
        found *= np.outer(factor, factor)
    count = all_of_lower[0] / _ALIKE
    found = with_less_correlation(found, count / (count + PRIOR))
    return _constant(found * (1.0 + _FEW / count), int(all_of_lower[0]))


def _settled(history: MovingHistory) -> int:
    """Return a stamp up to which no next sample changes a residual."""
    stamps = history.columns().stamps
    place = len(stamps)
    for _ in range(2 + max(_ORDERS)):  # different ones
        if not place:
            return BEGINNING
        place = bisect_left(stamps, stamps[place - 1])
    return stamps[place]


def _residuals(history: MovingHistory, span: Span, first: int, last: int) -> Sums:
    """Return the counts and the sums of squares of ``_PARTS``, as rows of cells."""
    starts = chosen(history, span.cell, first, last)
    columns = history.columns()
    begin = bisect_left(columns.stamps, first * span.cell)
    end = bisect_right(columns.stamps, span.newest)
    stamps = np.asarray(columns.stamps[begin:end], dtype=np.int64)
    # Of several samples with one stamp, the last counts.
    lasting = np.append(changes(stamps)[1:], len(stamps)) - 1
    poses = np.asarray(columns.poses).reshape(-1, POSE_FLOATS)[begin + lasting]
    stamps = stamps[lasting]
    terms = np.zeros((len(starts), _PARTS, 1 + PACKED_FLOATS))
    places = stamps.searchsorted(starts)
    for part, order in zip((0, 2), _ORDERS, strict=True):
        within = np.flatnonzero(places + order < len(stamps))
        around = places[within, None] + np.arange(order + 1)
        weights, usable = _divided_difference(stamps[around])
        within, around = within[usable], around[usable]
        errors = np.einsum('nk,nki->ni', weights[usable], _offsets(poses[around]))
        check_size(history, float(np.abs(errors).max(initial=0.0)))
        terms[within, part, 0] = 1.0
        terms[within, part, 1:] = packed_squares(errors)
    terms[:, 1] = terms[:, 0] * terms[:, 2, :1]
    used = stamps[np.minimum(places + max(_ORDERS), len(stamps) - 1)]
    return sums_by_cell(span.cell, first, last, starts, terms.reshape(
        len(starts), _PARTS * (1 + PACKED_FLOATS)), used)


def _divided_difference(stamps: Stamps) -> tuple[Array, Mask]:
    """
    Return the weights of divided differences, with a sum of squares of 1.

    The weight of a sample is 1 / prod(t - t_other): Hildebrand, "Introduction to Numerical
    Analysis", section 2.2.

    :param stamps: (n, k)
    :return: (n, k), and (n,) whether there is no long gap.
    """
    seconds = (stamps - stamps[:, :1]) * as_seconds(1)
    gaps = np.diff(seconds, axis=1)
    usable = gaps.max(axis=1) <= _LONGEST_GAP * np.median(gaps, axis=1)
    apart = (seconds[:, :, None] - seconds[:, None, :]) / seconds[:, -1:, None]
    apart[:, np.arange(stamps.shape[1]), np.arange(stamps.shape[1])] = 1.0
    weights = 1.0 / np.prod(apart, axis=2)
    return weights / np.linalg.norm(weights, axis=1)[:, None], usable


def _offsets(poses: Array) -> Array:
    """Return the offsets (n, k, 6) of successive poses (n, k, 7) from that in their middle."""
    middle = poses[:, poses.shape[1] // 2]
    return errors_of(se3.compose_many(se3.inverse_many(middle)[:, None, :], poses))


# --- the noise in a lookup

def _noise_of_edge(tree: Tree, history: MovingHistory, parent: str,
                   stamp: int | None) -> EdgeNoise | None:
    """Return ``required_noise``; None if there are too few samples."""
    newest = history.newest_stamp
    if newest is None:
        return None
    if parent == history.parent or stamp is None:
        return tree.companion_or_new(Learnt).of(history, SampleNoise).at(history, newest)[1]
    # It had another parent then; that is rare, so this noise is not cached.
    begin, end = next((begin, end) for _, begin, end in history.parents_between(
        BEGINNING, newest + 1) if begin <= stamp < end)
    return SampleNoise(history, begin).at(history, int(stamps_in(history, begin, end)[-1]))[1]


def required_noise(tree: Tree, history: MovingHistory, parent: str,
                   stamp: int | None = None) -> EdgeNoise:
    """
    Return the noise of an edge at a stamp, or of its newest samples; the tree is locked.

    :param parent: that of the edge then.
    :raises ExtrapolationException: there are too few samples.
    """
    found = _noise_of_edge(tree, history, parent, stamp)
    if found is None:
        raise ExtrapolationException(
            f'The noise of the edge {parent} -> {history.child} is unknown: to learn it takes '
            f'some {2 * _LEAST} samples of the last {as_seconds(LATELY):g} s with this parent, '
            'and there are fewer. Give the edge a covariance if it is always that slow',
            blocked_on=((history.child, (history.newest_stamp or 0) + 1),))
    return found


def add_noise(tree: Tree, errors: EdgeErrors, target: str, source: str, stamp: int, newest: bool,
              required: bool = True) -> None:
    """
    Add the learnt noise of all moving edges without a covariance to the errors of a lookup.

    :param stamp: that of the answer.
    :param newest: whether the lookup was for ``LATEST``; that stays unresolved if all edges are
        static. The tree is locked.
    :raises ExtrapolationException: an edge has too few samples, and its noise is required.
    """
    if target == source:
        return
    here = se3.IDENTITY
    for step in steps_between(tree, target, source,
                              None if newest and stamp == LATEST else stamp):
        pose = sample_of(step.history, stamp)
        before, here = here, se3.compose(here, se3.inverse(pose) if step.upwards else pose)
        add_noise_of(tree, errors, step, before if step.upwards else here, stamp, required)


def add_noise_of(tree: Tree, errors: EdgeErrors, step: Step, child: PoseTuple, stamp: int,
                 required: bool) -> None:
    """
    Add the noise of one edge, unless it has no samples, or a covariance, which includes it.

    :param child: the pose of the edge's child in the target. The others are those of
        ``add_noise``.
    """
    parent, history, _ = step
    if (not moves(history) or not history.takes_samples
            or known_covariances(tree, parent, history.child) is not None):
        return
    found = (required_noise if required else _noise_of_edge)(tree, history, parent, stamp)
    if found is not None:
        share = sum(weight**2 for _, weight in sample_weights(history, stamp))
        errors.add(step, child[3:], child[:3], one_term(pack(share * found.covariance).tobytes()))


def sample_weights(history: MovingHistory, stamp: int) -> list[tuple[int, float]]:
    """
    Return the stamps of the samples around a stamp, and their weights in the pose there.

    An interpolation of the caller's may take all from one sample, so one has the whole weight.
    """
    stamps = history.columns().stamps
    after = bisect_left(stamps, stamp)
    if not 0 < after < len(stamps):
        return [(stamps[min(after, len(stamps) - 1)], 1.0)]
    first, second = stamps[after - 1], stamps[after]
    ratio = (stamp - first) / (second - first)
    if not _is_blended(history):
        return [(second if ratio > 0.5 else first, 1.0)]
    return [(first, 1.0 - ratio), (second, ratio)]


def _is_blended(history: MovingHistory) -> bool:
    """Return whether the errors of two samples are weighted with the time between them."""
    interpolation = getattr(history, 'interpolation', LINEAR)
    return is_linear(interpolation) or closing_of(history) is not None


def between(ratio: Number) -> Number:
    """Return the variance of the noise between two samples, relative to that of a sample."""
    return ratio**2 + (1.0 - ratio)**2
