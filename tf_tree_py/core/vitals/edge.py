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

"""All that is known of one edge, and of the parents of one child."""

from collections.abc import Sequence

import numpy as np

from .gathering import Column
from .limits import Limits
from .motion import Motion
from .stretch import Rows, Steps, TAIL
from .timing import Timing
from ..geometry import se3
from ..geometry.so3 import Array
from ..text import shorten

Edge = tuple[str, str]

# At most this many publishers of an edge are named.
_MAX_AUTHORITIES = 8
# Characters of a name that a sentence shows.
_LONGEST = 80
# A static transform that differs by less than this, metres and radians together, is the same.
_SAME = 1e-6


class MovingEdge:
    """
    What arrived of one edge on a topic of what moves.

    :ivar timing: what its stamps and arrivals tell.
    :ivar motion: what its poses tell; samples that are no pose are left out.
    :ivar beside: the edges of the last message that had it.
    """

    def __init__(self, limits: Limits) -> None:
        self.timing = Timing()
        self.motion = Motion(limits)
        self.beside: Sequence[Edge] = ()
        self._tail: Rows | None = None

    def add(self, rows: Rows, beside: Sequence[Edge]) -> None:
        """Take samples, in order of arrival."""
        self.beside = beside
        self.timing.add(rows)
        useful = rows.of_use()
        if not len(useful):
            return
        self.motion.add(useful)
        stretch = useful[useful.stamps != 0].after(self._tail)
        # A step is judged by those before and after it, so the last rows are looked at again.
        self._tail = stretch.last(TAIL)
        if len(stretch) > TAIL:
            steps = Steps(stretch)
            self.timing.add_steps(steps)
            self.motion.add_steps(steps)


class FixedEdge:
    """
    What arrived of one edge on a topic of what does not move.

    :ivar count: samples.
    :ivar changes: how often the pose changed.
    :ivar gone: how far it went at most, metres.
    :ivar turned: how far it turned at most, radians.
    """

    def __init__(self) -> None:
        self.count = self.changes = 0
        self.gone = self.turned = 0.0
        self._pose: Array | None = None

    def add(self, rows: Rows) -> None:
        """Take samples, in order of arrival."""
        self.count += len(rows)
        poses = rows.of_use().poses
        if self._pose is not None:
            poses = np.concatenate([self._pose, poses])
        if not len(poses):
            return
        self._pose = poses[-1:].copy()
        gone, turned = se3.distance_many(poses[:-1], poses[1:])
        changed = gone + turned > _SAME
        if changed.any():
            self.changes += int(np.count_nonzero(changed))
            self.gone = max(self.gone, float(gone[changed].max()))
            self.turned = max(self.turned, float(turned[changed].max()))


class EdgeRecord:
    """
    All that is known of one edge.

    :ivar moving: what arrived of it on topics of moving transforms; None: nothing.
    :ivar fixed: what arrived of it on topics of static ones; likewise.
    :ivar authorities: who sends it.
    """

    def __init__(self, parent: str, child: str) -> None:
        self.parent = parent
        self.child = child
        self.moving: MovingEdge | None = None
        self.fixed: FixedEdge | None = None
        self.authorities: dict[str, None] = {}

    @property
    def frames(self) -> Edge:
        """Return its parent and its child."""
        return self.parent, self.child

    def __str__(self) -> str:
        return f'{shorten(self.parent, _LONGEST)} -> {shorten(self.child, _LONGEST)}'

    def add(self, column: Column, limits: Limits) -> None:
        """Take what has arrived."""
        for authority in sorted(column.authorities):
            if len(self.authorities) < _MAX_AUTHORITIES:
                self.authorities.setdefault(authority)
        # A pose may hold any finite number; sums of very large ones are infinite or NaN.
        with np.errstate(all='ignore'):
            if column.static:
                self.fixed = self.fixed or FixedEdge()
                self.fixed.add(column.rows)
            else:
                self.moving = self.moving or MovingEdge(limits)
                self.moving.add(column.rows, column.beside)


class Parents:
    """
    How often a child changed its parent.

    :ivar switches: how often.
    :ivar first: when a second parent was first noticed, nanoseconds.
    :ivar last: when it changed last.
    """

    def __init__(self) -> None:
        self.switches = self.first = self.last = 0
        self._last_parent = ''

    def add(self, columns: Sequence[Column]) -> None:
        """Take what arrived of one child at the same time."""
        if len(columns) == 1 and columns[0].edge[0] == self._last_parent:
            return
        order = np.concatenate([column.order for column in columns])
        received = np.concatenate([column.rows.received for column in columns])
        parents = list(dict.fromkeys(column.edge[0] for column in columns))
        which = np.repeat([parents.index(column.edge[0]) for column in columns],
                          [len(column.order) for column in columns])
        arrived = np.argsort(order, kind='stable')
        which, received = which[arrived], received[arrived]
        changes = np.flatnonzero(np.diff(which)) + 1
        if self._last_parent and parents[which[0]] != self._last_parent:
            changes = np.concatenate([[0], changes])
        self._last_parent = parents[which[-1]]
        if len(changes):
            self.switches += len(changes)
            self.first = self.first or int(received[changes[0]])
            self.last = int(received[changes[-1]])
