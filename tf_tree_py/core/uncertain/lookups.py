"""
Lookups that say how sure they are, and which edge they owe it to.

Edges without a covariance are certain. An edge above the meeting point of the two frames
is not walked, so what it may be off by drops out.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .propagation import Error, placed, Step, steps_of, total
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..times import Stamps
from ..tree.queries import Queries
from ..tree.tree import Tree

# Stamps that are handled at once: a covariance takes 288 bytes, and there are several of each.
_BLOCK = 8192


class Share(NamedTuple):
    """
    What one edge adds to the uncertainty of a lookup.

    :ivar covariance: (6, 6), of the source's pose in the target; those of all edges add
        up to the lookup's.
    :ivar position: its part of the variance of the position, 0 to 1.
    :ivar rotation: its part of the variance of the rotation, 0 to 1.
    """

    parent: str
    child: str
    covariance: Array
    position: float
    rotation: float


class Uncertain(NamedTuple):
    """``target_T_source``, and how far it may be off; see ``geometry.covariances``."""

    stamp: int
    pose: PoseTuple
    covariance: Array


def lookup_uncertain(tree: Queries, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                     independent: bool = False) -> Uncertain:
    """Return a pose, its covariance, and what ``LATEST`` came to; see ``UncertainQueries``."""
    stamp, pose, errors = _errors(tree, target_frame, source_frame, stamp, independent)
    return Uncertain(stamp, pose, total(errors, np.array([pose[:3]]))[0])


def lookup_budget(tree: Queries, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                  independent: bool = False) -> list[Share]:
    """Return what each edge adds to the covariance; see ``UncertainQueries``."""
    _, pose, errors = _errors(tree, target_frame, source_frame, stamp, independent)
    return _shares(errors, np.array([pose[:3]]))


def _errors(tree: Queries, target: str, source: str, asked: int,
            independent: bool) -> tuple[int, PoseTuple, list[Error]]:
    with tree._lock:
        stamp, pose = tree.lookup_stamped(target, source, asked)
        # Where nothing moves, LATEST comes to no stamp at all.
        moment = stamp or None if asked == LATEST else stamp
        return stamp, pose, _errors_at(tree, target, source, moment, independent)


def _shares(errors: Sequence[Error], point: Array) -> list[Share]:
    covariances = [error.share(point)[0] for error in errors]
    whole = sum(covariances, np.zeros((6, 6)))
    shares = [Share(error.step.parent, error.step.history.child, covariance,
                    _part(covariance[:3, :3], whole[:3, :3]),
                    _part(covariance[3:, 3:], whole[3:, 3:]))
              for error, covariance in zip(errors, covariances, strict=True)]
    return sorted(shares, key=lambda share: (-share.position, -share.rotation))


def _part(one: Array, whole: Array) -> float:
    return float(np.trace(one) / np.trace(whole)) if np.trace(whole) > 0.0 else 0.0


def _errors_at(tree: Queries, target: str, source: str, moment: int | None,
               independent: bool) -> list[Error]:
    """Return the errors at a stamp that there is an answer for; the lock is held."""
    if target == source or not tree._tree.uncertainty:
        return []
    steps = steps_of(tree._tree.ways.branches(target, source, moment))
    stamp = moment or LATEST
    covariances = covariances_of(tree._tree, steps, np.array([stamp]), independent)
    poses = (np.array([step.history.sample(stamp)]) for step in steps)
    return placed(steps, poses, covariances)[1]


def covariances_of(tree: Tree, steps: Sequence[Step], stamps: Stamps,
                   independent: bool) -> list[Array | None]:
    """Return each edge's own covariances (N, 6, 6) at stamps; None of those without."""
    covariances: list[Array | None] = []
    for parent, history, _ in steps:
        known = tree.uncertainty.get(history.child)
        covariances.append(known.at(stamps, history, independent)
                           if known is not None and known.parent == parent else None)
    return covariances


# --- many

def lookup_uncertain_many(tree: Queries, target_frame: str, source_frame: str,
                          stamps: npt.ArrayLike, *,
                          independent: bool = False) -> tuple[Array, Array]:
    """Return poses and covariances at many stamps; see ``UncertainQueries``."""
    frozen = tree.snapshot()
    poses = frozen.lookup_many(target_frame, source_frame, stamps)
    times = frozen._stamps_of(stamps)
    if frozen._tree.ways.was_rehung:
        errors = [_errors_at(frozen, target_frame, source_frame, stamp, independent)
                  for stamp in times.tolist()]
        return poses, _stacked([total(each, pose[None, :3])
                                for each, pose in zip(errors, poses, strict=True)])
    if target_frame == source_frame or not frozen._tree.uncertainty:
        return poses, np.zeros((len(times), 6, 6))
    steps = steps_of(frozen._tree.ways.branches(target_frame, source_frame, None))
    return poses, _stacked([
        _total_at(frozen._tree, steps, times[begin:begin + _BLOCK],
                  poses[begin:begin + _BLOCK, :3], independent)
        for begin in range(0, len(times), _BLOCK)])


def _total_at(tree: Tree, steps: Sequence[Step], stamps: Stamps, points: Array,
              independent: bool) -> Array:
    ends = int(stamps.min()), int(stamps.max())
    covariances = covariances_of(tree, steps, stamps, independent)
    poses = (step.history.track(*ends).at(stamps).T for step in steps)
    return total(placed(steps, poses, covariances)[1], points)


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
