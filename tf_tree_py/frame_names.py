# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Renaming frames, and choosing which edges to take.

Several robots that run the same software publish the same names. A prefix distinguishes
them: ``robot1/base_link``. Filters receive the published names, without the leading slash
that old software writes.
"""

from collections.abc import Callable, Collection
from typing import NamedTuple

from tf_tree_py.core.messages.message_layout import as_published, Rename

FrameFilter = Callable[[str, str], bool] | Collection[str]


class FrameNames(NamedTuple):
    """
    How frames are renamed, and which edges are dropped; each step is optional.

    :ivar wanted: returns whether to take an edge, given its published names.
    :ivar shared: frames that keep their name, such as ``map``.
    :ivar strip: the prefix to remove from all other frames; a frame without it is dropped.
    :ivar add: the prefix to add after that.
    """

    wanted: Callable[[str, str], bool]
    shared: frozenset[str] = frozenset()
    strip: str = ''
    add: str = ''

    def edge(self, parent: str, child: str) -> tuple[str, str] | None:
        """Return an edge's new names, or None if it is dropped."""
        parent, child = _without_slash(parent), _without_slash(child)
        if not self.wanted(parent, child):
            return None
        new_parent, new_child = self.frame(parent), self.frame(child)
        return None if new_parent is None or new_child is None else (new_parent, new_child)

    def frame(self, name: str) -> str | None:
        """Return a frame's new name, or None if it is dropped."""
        # An empty name stays empty, so that it is refused later.
        if not name or name in self.shared:
            return name
        if not name.startswith(self.strip):
            return None
        return self.add + name[len(self.strip):]


def rename(*, frame_prefix: str = '', strip_frame_prefix: str = '',
           shared_frames: Collection[str] = (),
           frame_filter: FrameFilter | None = None) -> Rename:
    """
    Return a function that renames edges, for listeners, broadcasters and the relay.

    :param frame_prefix: the prefix to add to every frame, such as ``robot1/``.
    :param strip_frame_prefix: the prefix to remove before that; an edge with a frame that
        does not have it is dropped.
    :param shared_frames: frames that keep their name, such as ``map``.
    :param frame_filter: returns whether to take (parent, child); or a collection of
        frames: an edge is taken if both of its frames are in it.
    :raises ValueError: a string instead of a collection of strings.
    """
    if not (frame_prefix or strip_frame_prefix or frame_filter is not None):
        return as_published
    return FrameNames(edge_filter(frame_filter), _as_set('shared_frames', shared_frames),
                      _without_slash(strip_frame_prefix), _without_slash(frame_prefix)).edge


def edge_filter(frame_filter: FrameFilter | None) -> Callable[[str, str], bool]:
    """Return whether to take an edge, as a function of parent and child; None: every edge."""
    if frame_filter is None:
        return lambda parent, child: True
    if callable(frame_filter):
        return frame_filter
    frames = _as_set('frame_filter', frame_filter)
    return lambda parent, child: parent in frames and child in frames


def _as_set(what: str, names: Collection[str]) -> frozenset[str]:
    if isinstance(names, str):
        raise ValueError(f'{what} has to be a collection of frame names, such as [{names!r}]')
    return frozenset(map(_without_slash, names))


def _without_slash(name: str) -> str:
    return name.removeprefix('/')
