"""
What one robot's frames are called elsewhere, and which of its edges are let through.

Several robots that run the same software publish the same names, and a prefix
tells them apart: ``robot1/base_link``. Names are judged as they arrive, without
the slash that old software puts in front.
"""

from collections.abc import Callable, Collection
from typing import NamedTuple

# What to make of (parent, child): None is left out.
Rename = Callable[[str, str], tuple[str, str] | None]
FrameFilter = Callable[[str, str], bool] | Collection[str]


def as_published(parent: str, child: str) -> tuple[str, str] | None:
    """Return the names of an edge as they are, without leading slashes."""
    return _without_slash(parent), _without_slash(child)


class FrameNames(NamedTuple):
    """
    How frames are renamed, and which are left out; each step may be absent.

    :ivar wanted: whether to let an edge through, by its names as they arrive.
    :ivar shared: frames that keep their name, such as ``map``.
    :ivar strip: taken from the front of every other; what does not have it is left out.
    :ivar add: then put in front.
    """

    wanted: Callable[[str, str], bool] | None = None
    shared: frozenset[str] = frozenset()
    strip: str = ''
    add: str = ''

    def edge(self, parent: str, child: str) -> tuple[str, str] | None:
        """Return an edge's new names, or None when it is left out."""
        parent, child = _without_slash(parent), _without_slash(child)
        if self.wanted is not None and not self.wanted(parent, child):
            return None
        new_parent, new_child = self.frame(parent), self.frame(child)
        return None if new_parent is None or new_child is None else (new_parent, new_child)

    def frame(self, name: str) -> str | None:
        """Return a frame's new name, or None when it is left out."""
        # A name that is missing must not become one.
        if not name or name in self.shared:
            return name
        if not name.startswith(self.strip):
            return None
        return self.add + name[len(self.strip):]


def rename(*, frame_prefix: str = '', strip_frame_prefix: str = '',
           shared_frames: Collection[str] = (),
           frame_filter: FrameFilter | None = None) -> Rename:
    """
    Return what to make of an edge, as listeners, broadcasters and the relay take it.

    :param frame_prefix: put in front of every frame, such as ``robot1/``.
    :param strip_frame_prefix: taken from the front before that; an edge of a frame that
        does not have it is left out.
    :param shared_frames: keep their name, such as ``map``.
    :param frame_filter: whether to let (parent, child) through, or all frames to let
        through: an edge between two of them.
    :raises ValueError: a string where a collection of strings belongs.
    """
    if not (frame_prefix or strip_frame_prefix or frame_filter is not None):
        return as_published
    return FrameNames(_as_predicate(frame_filter), _as_set('shared_frames', shared_frames),
                      _without_slash(strip_frame_prefix), _without_slash(frame_prefix)).edge


def _as_predicate(frame_filter: FrameFilter | None) -> Callable[[str, str], bool] | None:
    if frame_filter is None or callable(frame_filter):
        return frame_filter
    frames = _as_set('frame_filter', frame_filter)
    return lambda parent, child: parent in frames and child in frames


def _as_set(what: str, names: Collection[str]) -> frozenset[str]:
    if isinstance(names, str):
        raise ValueError(f'{what} has to be a collection of frame names, such as [{names!r}]')
    return frozenset(map(_without_slash, names))


def _without_slash(name: str) -> str:
    return name.removeprefix('/')
