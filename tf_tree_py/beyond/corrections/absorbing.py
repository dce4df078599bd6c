# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Corrections of a tree's edges: absorbing and querying them.

``edges.corrected`` moves the samples.
"""

from typing import NamedTuple

from tf_tree_py.core.edges.storage import Arrays, Stored
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.tree.companions import Companion, storable
from tf_tree_py.core.tree.tree import Tree

from .blend import BlendLimits
from .corrected import corrected, CorrectedHistory
from .stage import Stage


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


@storable
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

    def frozen(self, arrays: Arrays) -> int:
        """Return the number."""
        return self.count

    @classmethod
    def thawed(cls, stored: Stored) -> 'Transitions':
        """Return the frozen number."""
        return cls(stored.whole(cls.key))


def absorb(tree: Tree, child: str, motion: PoseTuple, seen_at: int | None,
           about: Vector3, limits: BlendLimits) -> Transition:
    """Start the transition of an edge to a correction; see ``BufferCore.correct``."""
    history = corrected(tree.histories.get(child), child)
    if seen_at is not None and history.latest_stamp is not None:
        _check_seen(seen_at, history.latest_stamp)
    tree.replace(history)
    before = history.stage()
    stage = history.absorb(motion, seen_at, about, limits)
    return transition(tree, stage, is_new=stage is not before)


def _check_seen(seen_at: int, newest: int) -> None:
    if seen_at > newest:
        raise InvalidArgumentException(
            f'Invalid argument stamp {seen_at}: the correction cannot have been seen after the '
            f"edge's newest sample, {newest}")


def transition(tree: Tree, stage: Stage, *, is_new: bool = True) -> Transition:
    """Return the transition of a stage; count it if it is new."""
    transitions = tree.companion_or_new(Transitions)
    transitions.count += is_new
    return Transition(transitions.count, stage.begin, stage.end, Pose._make(stage.motion))


def smoothed(tree: Tree) -> Tree:
    """Return a copy of a tree with all corrections applied to the past, too."""
    twin = tree.copy()
    for history in list(twin.histories.values()):
        if isinstance(history, CorrectedHistory):
            twin.replace(history.smoothed())
    return twin


def correction_of(tree: Tree, child: str) -> Pose:
    """Return the newest correction of an edge, even in its transition; the identity if none."""
    history = tree.histories.get(child)
    stage = history.stage() if isinstance(history, CorrectedHistory) else None
    return Pose._make(se3.IDENTITY if stage is None else stage.motion)
