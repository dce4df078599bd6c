# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The connected pieces of a tree, and whether they are separate robots."""

from collections.abc import Iterable, Mapping, Sequence


def pieces_of(edges: Iterable[tuple[str, str]]) -> list[list[str]]:
    """Return the frames of each connected piece of a tree, the largest first."""
    neighbours: dict[str, list[str]] = {}
    for parent, child in edges:
        neighbours.setdefault(parent, []).append(child)
        neighbours.setdefault(child, []).append(parent)
    pieces, seen = [], set[str]()
    for frame in neighbours:
        if frame not in seen:
            pieces.append(_reached(frame, neighbours))
            seen.update(pieces[-1])
    return sorted(pieces, key=len, reverse=True)


def are_robots(pieces: Sequence[Sequence[str]]) -> bool:
    """Return whether each piece has a prefix of its own, such as ``robot1``."""
    prefixes = [_prefix(piece) for piece in pieces]
    return len(set(prefixes)) == len(pieces) and '' not in prefixes


def _prefix(piece: Sequence[str]) -> str:
    prefixes = {frame.partition('/')[0] if '/' in frame else '' for frame in piece}
    return prefixes.pop() if len(prefixes) == 1 else ''


def _reached(frame: str, neighbours: Mapping[str, Sequence[str]]) -> list[str]:
    reached, waiting = dict.fromkeys([frame]), [frame]
    while waiting:
        new = [other for other in neighbours[waiting.pop()] if other not in reached]
        reached |= dict.fromkeys(new)
        waiting += new
    return list(reached)
