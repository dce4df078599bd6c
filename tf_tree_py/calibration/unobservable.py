# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Describe in words what the observations do not show, and the motion that would show it."""

from typing import NamedTuple

import numpy as np

from .model import Model, Unknowns
from .observability import Held, MOSTLY, parts
from .observations import Array

_AXES = 'xyz'
_SOME = 0.35
"""From this length on, a second part of a hidden direction is named."""
_ALONG_M = 1e-6
"""Smaller motions between two edges, metres and radians, are none."""


class Unobservable(NamedTuple):
    """
    A direction that the observations do not show.

    :ivar what: in words, such as 'the translation along z of base -> camera'.
    :ivar remedy: what would show it.
    :ivar parent: the parent of the edge; '' for a time offset.
    :ivar child: the child of the edge, or the sensor of a time offset.
    :ivar kind: 'translation', 'rotation', 'both' or 'time'; 'both' if the observations do not
        show the edge and the time apart.
    :ivar axis: (3,) in the parent's axes; zeros for a time.
    :ivar product_with: (parent, child) of another edge, if only the product of the two is
        observable; otherwise None.
    """

    what: str
    remedy: str
    parent: str
    child: str
    kind: str
    axis: tuple[float, float, float]
    product_with: tuple[str, str] | None = None


def described(model: Model, held: Held) -> list[Unobservable]:
    """Describe held directions in words, along the axes of the parent where possible."""
    return [_described(model, *pair) for pair in zip(held.plain.T, held.hidden.T, strict=True)]


def _described(model: Model, plain: Array, hidden: Array) -> Unobservable:
    """Describe a direction (Q,) that is held for a hidden one, which may have other parts."""
    unknowns = model.unknowns
    own = next(part for part in parts(unknowns) if plain[part].any())
    others = hidden.copy()
    others[own] = 0.0
    if own.start >= unknowns.times.start:
        sensor = unknowns.sensors[own.start - unknowns.times.start]
        return Unobservable(
            f'the time of {sensor}', 'move faster: a time offset shows only while the '
            'target moves past the sensor', '', sensor, 'time', (0.0, 0.0, 0.0))
    number, turns = divmod(own.start, 6)
    parent, child = unknowns.edges[number]
    axis = plain[own] * np.sign(plain[own][np.abs(plain[own]).argmax()])
    name = _axis_name(axis)
    kind = 'rotation' if turns else 'translation'
    whole = f'the {kind} {"about" if turns else "along"} {name} of {parent} -> {child}'
    vector = (float(axis[0]), float(axis[1]), float(axis[2]))
    if np.abs(others[unknowns.times]).max() > _SOME:
        sensor = unknowns.sensors[int(np.abs(others[unknowns.times]).argmax())]
        return Unobservable(
            f'{whole} apart from the time of {sensor}',
            'vary the speed, and drive backwards too: at one constant speed, a late stamp and '
            'a shifted mounting look the same', parent, child, 'both', vector)
    other = _other_edge(unknowns, number, others)
    if other is not None:
        return _between(model, number, other, whole, kind, vector)
    mover = _mover(model, number)
    if np.linalg.norm(others[unknowns.edge(number)]) > _SOME:
        return Unobservable(
            f'{whole} apart from its {"translation" if turns else "rotation"}',
            f'turn {mover} about two axes that are not parallel, at several places',
            parent, child, kind, vector)
    return Unobservable(
        whole, f'turn {mover} about two axes that are not parallel, or move it across {name}'
        if turns else f'turn {mover} about an axis that is not {name}: only a rotation shows '
        'the lever arm', parent, child, kind, vector)


def _other_edge(unknowns: Unknowns, number: int, others: Array) -> int | None:
    """Return the other edge with the largest part in a direction, if that is large."""
    lengths = [0.0 if each == number else float(np.linalg.norm(others[unknowns.edge(each)]))
               for each in range(len(unknowns.edges))]
    largest = int(np.argmax(lengths))
    return largest if lengths[largest] > _SOME else None


def _between(model: Model, number: int, other: int, whole: str, kind: str,
             vector: tuple[float, float, float]) -> Unobservable:
    """Describe a direction of an edge for which another edge can make up."""
    edge, parent_child = model.unknowns.edges[number], model.unknowns.edges[other]
    first, second = (' -> '.join(model.unknowns.edges[each]) for each in sorted((number, other)))
    if _move_apart(model, number, other):
        return Unobservable(
            f'{whole} apart from {" -> ".join(parent_child)}',
            'move the joints between the two edges farther, or choose one of them with --edge',
            *edge, kind, vector)
    return Unobservable(
        f'only the product of {first} and {second} is observable', 'choose one of them with '
        '--edge', *edge, kind, vector, parent_child)


def _move_apart(model: Model, number: int, other: int) -> bool:
    """Return whether something moves between two edges, wherever both are on one path."""
    for _, ways in model.seen:
        edges = [link.edge for link in ways.chain.links]
        if number in edges and other in edges:
            first, last = sorted((edges.index(number), edges.index(other)))
            for poses in ways.at(0)[first + 1:last + 1]:
                if np.ptp(poses, axis=0).max(initial=0.0) > _ALONG_M:
                    return True
    return False


def _mover(model: Model, number: int) -> str:
    """Return the frame that has to turn to show an edge: one that can."""
    parent = model.unknowns.edges[number][0]
    for each, ways in model.seen:
        if any(link.edge == number for link in ways.chain.links) and not model.moves(parent):
            return each.fixed_in if model.moves(each.fixed_in) else parent
    return parent


def _axis_name(axis: Array) -> str:
    place = int(np.abs(axis).argmax())
    if abs(axis[place]) ** 2 > MOSTLY:
        return _AXES[place]
    return '(' + ', '.join(f'{value:.2f}' for value in axis) + ')'
