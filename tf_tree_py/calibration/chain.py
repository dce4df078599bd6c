# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The path from the frame in which a target rests to the sensor that observes it.

The unknown edges divide the path into stretches, which are looked up in the tree at stamps
that a time offset may shift.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore, Snapshot
from tf_tree_py.core import se3, TransformException

from .observations import Array, CalibrationError, Mask, Stamps

Edge = tuple[str, str]
Tree = BufferCore | Snapshot


class Link(NamedTuple):
    """
    An unknown edge on the path.

    :ivar edge: its number.
    :ivar upwards: whether the path leads from its child to its parent.
    """

    edge: int
    upwards: bool


class Chain(NamedTuple):
    """
    The path from one frame to another.

    :ivar links: the unknown edges, in order.
    :ivar stretches: (target, source) of the paths before, between and after them.
    """

    links: list[Link]
    stretches: list[Edge]


def chain_between(tree: Tree, fixed_in: str, sensor: str, edges: Sequence[Edge]) -> Chain:
    """
    Return the path from one frame to another, with the unknown edges on it.

    :raises CalibrationError: the tree lacks a frame, or does not connect the two.
    """
    parents = {edge.child: edge.parent for edge in tree.edges()}
    known = tree.frames()
    for frame, role in ((fixed_in, 'the target rests in'), (sensor, 'the observations are in')):
        if frame not in known:
            raise CalibrationError(
                f'{role} {frame!r}, which is not in the tree; it has: {_some(known)}')
    down = _climb(fixed_in, parents)
    up = _climb(sensor, parents)
    meeting = next((frame for frame in down if frame in set(up)), None)
    if meeting is None:
        raise CalibrationError(f'the tree does not connect {fixed_in!r} and {sensor!r}: record '
                               'the edges between them, too')
    steps = [(parents[child], child, True) for child in down[:down.index(meeting)]]
    steps += [(parents[child], child, False)
              for child in reversed(up[:up.index(meeting)])]
    links, stretches, begin = list[Link](), list[Edge](), fixed_in
    for parent, child, upwards in steps:
        if (parent, child) in edges:
            near, far = (child, parent) if upwards else (parent, child)
            links.append(Link(edges.index((parent, child)), upwards))
            stretches.append((begin, near))
            begin = far
    return Chain(links, [*stretches, (begin, sensor)])


def check_edges(tree: Tree, edges: Sequence[Edge]) -> None:
    """
    Check that edges may be calibrated.

    :raises CalibrationError: an edge does not exist, or moves.
    """
    if not edges:
        raise CalibrationError('no edge to calibrate was named')
    if len(set(edges)) < len(edges):
        raise CalibrationError('an edge was named twice')
    infos = {(info.parent, info.child): info for info in tree.edges()}
    for parent, child in edges:
        info = infos.get((parent, child))
        if info is None:
            there = _some([f'{a} -> {b}' for (a, b), each in infos.items() if each.static])
            turned = (child, parent) in infos
            raise CalibrationError(
                f'the tree has no edge {parent} -> {child}'
                + (f', but {child} -> {parent}: name the parent first' if turned else
                   f'; its static ones are: {there or "none"}. Publish a rough guess of it first'))
        if not info.static:
            raise CalibrationError(
                f'the edge {parent} -> {child} moves, and only a static one has one value to '
                'estimate: name the static edge of the mounting')


def _climb(frame: str, parents: dict[str, str]) -> list[str]:
    frames = [frame]
    while frames[-1] in parents and parents[frames[-1]] not in frames:
        frames.append(parents[frames[-1]])
    return frames


def _some(names: Sequence[str]) -> str:
    shown = ', '.join(names[:12])
    return shown + (f' and {len(names) - 12} more' if len(names) > 12 else '')


class Ways:
    """
    Looks up the stretches of a chain at shifted stamps, and caches the last few answers.

    :param stamps: (N,) of the observations.
    """

    def __init__(self, tree: Tree, chain: Chain, stamps: Stamps) -> None:
        self.chain, self.stamps = chain, stamps
        self._tree = tree
        self._known: dict[int, list[Array]] = {}

    def at(self, shift: int) -> list[Array]:
        """
        Return the poses (N, 7) of each stretch at the stamps minus a shift, nanoseconds.

        Where there is no answer they are NaN.
        """
        if shift not in self._known:
            if len(self._known) > 8:
                self._known.pop(next(iter(self._known)))
            self._known[shift] = [self._looked_up(*stretch, self.stamps - shift)
                                  for stretch in self.chain.stretches]
        return self._known[shift]

    def valid(self, shift: int) -> Mask:
        """Return whether the tree has all stretches at each stamp, (N,)."""
        return np.all([np.isfinite(poses).all(axis=1) for poses in self.at(shift)], axis=0)

    def _looked_up(self, target: str, source: str, stamps: Stamps) -> Array:
        if target == source:
            return np.tile(se3.IDENTITY, (len(stamps), 1))
        try:
            return np.asarray(self._tree.lookup_many(target, source, stamps, outside='mask')[0])
        except TransformException as error:
            raise CalibrationError(f'the tree does not connect {target} and {source}: {error}'
                                   ) from error

    def covariances(self, shift: int) -> list[tuple[int, Array]]:
        """Return the uncertain stretches: the number of each, and its (N, 6, 6)."""
        if not self._tree.has_covariances:
            return []
        found = [(number, self._tree.lookup_uncertain_many(*stretch, self.stamps - shift)[1])
                 for number, stretch in enumerate(self.chain.stretches)
                 if stretch[0] != stretch[1]]
        return [(number, each) for number, each in found if each.any()]
