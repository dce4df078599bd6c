# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Corrections of a tree's edges: absorbing them, and questions about them.

``edges.corrected`` knows how samples are moved.
"""

from typing import NamedTuple

from .tree import Tree
from ..edges.corrected import corrected, CorrectedHistory
from ..edges.correction import Stage
from ..errors import InvalidArgumentException
from ..geometry import se3
from ..geometry.blend import Limits
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Vector3


class Transition(NamedTuple):
    """
    An edge goes over to another correction, or to another source.

    :ivar version: how many transitions the buffer has had, this one included.
    :ivar begin: the stamp up to which every answer stays as it was, nanoseconds.
    :ivar end: the stamp from which on the correction holds wholly.
    :ivar motion: that correction, of the samples as they come in.
    """

    version: int
    begin: int
    end: int
    motion: Pose


def absorb(tree: Tree, child: str, motion: PoseTuple, seen_at: int | None,
           about: Vector3, limits: Limits) -> Transition:
    """Let an edge go over to a correction; see ``BufferCore.correct``."""
    history = corrected(tree.histories.get(child), child)
    if seen_at is not None and history.latest_stamp is not None:
        _check_seen(seen_at, history.latest_stamp)
    tree.replace(history)
    return counted(tree, history.absorb(motion, seen_at, about, limits))


def _check_seen(seen_at: int, newest: int) -> None:
    if seen_at > newest:
        raise InvalidArgumentException(
            f'Invalid argument stamp {seen_at}: the correction cannot have been seen after the '
            f"edge's newest sample, {newest}")


def counted(tree: Tree, stage: Stage) -> Transition:
    """Return how an edge goes over to something else, and count that."""
    tree.corrections += 1
    return Transition(tree.corrections, stage.fade.begin, stage.fade.end,
                      Pose._make(stage.motion))


def smoothed(tree: Tree) -> Tree:
    """Return a copy of a tree with all corrections applied to the past, too."""
    twin = tree.copy()
    for history in list(twin.histories.values()):
        if isinstance(history, CorrectedHistory):
            twin.replace(history.smoothed())
    return twin


def correction_of(tree: Tree, child: str) -> Pose:
    """Return the correction that an edge has or goes over to; the identity if there is none."""
    history = tree.histories.get(child)
    if isinstance(history, CorrectedHistory):
        return Pose._make(history.correction.stage.motion)
    return Pose._make(se3.IDENTITY)
