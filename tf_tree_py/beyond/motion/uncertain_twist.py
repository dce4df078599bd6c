# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The velocity of a frame, with the covariance that follows from the noise of the samples.

The samples' noise is learnt (``uncertainty.noise``). Poses that are off by one deviation in each
direction, to both sides, are sent through the formulas of ``twist``.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from tf_tree_py.core.edges.protocol import moves, MovingHistory
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.queries import FramesInErrors
from tf_tree_py.screws import carry_many

from .twist import after_edge, interval_at, lookup_twist, ORIGIN, twists_between, Velocity
from ..uncertainty.covariances import root_of
from ..uncertainty.noise import required_noise, sample_weights
from ..uncertainty.propagation import steps_between
from ..uncertainty.queries import UncertainQueries


def lookup_twist_uncertain(tree: UncertainQueries, tracking_frame: str, observation_frame: str,
                           stamp: Stamp, averaging_interval: int, *,
                           reference_frame: str | None = None,
                           reference_point: Vector3 = ORIGIN,
                           reference_point_frame: str | None = None) -> tuple[Velocity, Array]:
    """
    Return the velocity of ``lookup_twist``, and its covariance.

    The covariance is that of the samples' noise, which ``edge_noise`` returns: errors that are
    independent from sample to sample, in the poses at both ends of the interval and at the
    stamp. Errors that last longer than the interval hardly change a velocity, and are not in it.
    The covariance also leaves out that the mean over an interval differs from the velocity at the
    stamp: a longer interval has less noise, but a larger difference. Curves are exact.

    :param tree: a buffer or a snapshot; the other parameters are those of ``lookup_twist``.
    :return: the velocity, and (6, 6) of its linear and angular part, (m/s)^2 and (rad/s)^2, in
        the same axes.
    :raises ExtrapolationException: an edge has too few samples to learn its noise from.
    :raises TransformException: as in ``lookup_twist``.
    """
    axes = reference_frame or observation_frame
    with tree._lock, FramesInErrors(tree._tree, observation_frame, tracking_frame):
        velocity = lookup_twist(
            tree, tracking_frame, observation_frame, stamp, averaging_interval,
            reference_frame=reference_frame, reference_point=reference_point,
            reference_point_frame=reference_point_frame)
        stamp = velocity.stamp
        interval = interval_at(tree, tracking_frame, observation_frame, stamp, averaging_interval)
        if interval is None:
            return velocity, np.zeros((6, 6))
        moved, turned, pointed = (_steps(tree, *ends, stamp) for ends in (
            (observation_frame, tracking_frame), (axes, tracking_frame),
            (axes, reference_point_frame or tracking_frame)))
        poses = _Poses(tree, moved, [*turned, *pointed], (interval[0], stamp, interval[1]))
        own = [_own_twist(tree, step, stamp) for step in moved]
    twists = np.zeros((1, 6))
    for step, known in zip(moved, own, strict=True):
        twists = after_edge(twists, *poses.along(step), interval[1] - interval[0], known)
    to_axes = poses.product(turned)
    to_axes[:, :3] -= se3.apply_many(poses.product(pointed), np.array(reference_point))
    offs = carry_many(to_axes, twists).reshape(2, -1, 6)
    halves = 0.5 * (offs[0] - offs[1])
    return velocity, np.asarray(halves.T @ halves)


def _steps(tree: UncertainQueries, target: str, source: str, stamp: int) -> list[Step]:
    return [] if target == source else steps_between(tree._tree, target, source, stamp)


def _own_twist(tree: UncertainQueries, step: Step, stamp: int) -> Array | None:
    """Return the twist of an edge that provides it, (1, 6)."""
    ends = step.parent, step.history.child
    return twists_between(tree, *(ends[::-1] if step.upwards else ends), np.array([stamp]))


class _Poses:
    """
    The poses of edges at three times, each off by one deviation of their noise, to both sides.

    :param moved: the edges whose motion counts; ``others``: those whose pose at the stamp does.
    :param interval: its beginning, the stamp and its end.
    """

    def __init__(self, tree: UncertainQueries, moved: Sequence[Step], others: Sequence[Step],
                 interval: tuple[int, int, int]) -> None:
        self._poses = {}
        at_stamp = (interval[1],) * 3
        edges = {step.history.child: (step, at_stamp) for step in others} | {
            step.history.child: (step, interval) for step in moved}
        roots = {child: _root(tree, *edge) for child, edge in edges.items()}
        self._count, place = sum(len(root) for root in roots.values()), 0
        for child, (step, times) in edges.items():
            offs, root = np.zeros((self._count, 3, 6)), roots[child]
            offs[place:place + len(root)] = root
            place += len(root)
            offs = np.concatenate([offs, -offs])
            poses = np.array([tree.lookup_at(step.parent, child, time) for time in times])
            self._poses[child] = se3.compose_many(
                np.broadcast_to(poses, (len(offs), 3, 7)), np.concatenate(
                    [offs[..., :3], so3.exp_many(offs[..., 3:])], axis=-1))

    def along(self, step: Step) -> tuple[Array, Array, Array]:
        """Return the poses of an edge at all three times, (2 n, 7) each."""
        poses = self._poses[step.history.child]
        before, now, after = np.moveaxis(
            se3.inverse_many(poses) if step.upwards else poses, 1, 0)
        return before, now, after

    def product(self, steps: Iterable[Step]) -> Array:
        """Return the poses of a path at the stamp, (2 n, 7)."""
        here = np.tile(np.array(se3.IDENTITY), (2 * self._count, 1))
        for step in steps:
            here = se3.compose_many(here, self.along(step)[1])
        return here


def _root(tree: UncertainQueries, step: Step, times: Sequence[int]) -> Array:
    """
    Return the deviations of an edge's poses at three times, in the axes of the child.

    :return: (n, 3, 6): n vectors whose squares add up to the covariance of all three poses.
    """
    history = step.history
    if not moves(history) or not history.takes_samples:
        return np.zeros((0, 3, 6))
    noise = root_of(required_noise(tree._tree, history, step.parent, times[1]).covariance)
    weights = _weights(history, times)
    roots = np.einsum('tk,ij->kjti', root_of(weights @ weights.T), noise)
    return np.asarray(roots.reshape(-1, 3, 6))


def _weights(history: MovingHistory, times: Sequence[int]) -> Array:
    """Return the weights of samples in the poses at some times, (times, samples)."""
    weights: dict[int, Array] = {}
    for number, time in enumerate(times):
        for sample, weight in sample_weights(history, time):
            weights.setdefault(sample, np.zeros(len(times)))[number] = weight
    return np.array([*weights.values()]).T
