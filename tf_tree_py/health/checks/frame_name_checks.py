# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of frame names."""

from collections.abc import Iterator
import re

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.text import listed, times

from .case import Case
from .check import check, of_trouble, publishers_of, Remark
from .finding import Severity

_SEPARATOR = re.compile(r'(?<![0-9])[\W_]+|[\W_]+(?![0-9])')


def likeness(name: str) -> str:
    """Return a name in lower case, without blanks and separators."""
    # A separator between two digits is kept: link_1_1 is not link_11.
    return _SEPARATOR.sub('', name.casefold())


@check(Severity.WARNING,
       catches='names that differ only in case, separators or blanks: base_link and baselink',
       cause='the same frame is spelled in two ways, such as in a URDF and in a parameter file',
       fix='use one spelling; if they are two frames, give them names that differ')
def similar_names(case: Case) -> Iterator[Remark]:
    """Find frames whose names have the same likeness."""
    alike: dict[str, list[str]] = {}
    for frame in case.frames:
        alike.setdefault(likeness(frame), []).append(frame)
    for names in alike.values():
        if len(names) > 1:
            edges = [edge for edge in case.edges if {*edge.frames} & {*names}]
            told = listed([repr(name) for name in names])
            pieces = sum(any(name in tree for name in names) for tree in case.trees)
            yield Remark(
                f'{told} look like one frame' + (
                    ', and their trees are not connected' if pieces > 1 else ''),
                tuple(names), publishers_of(*edges), {'names': len(names), 'trees': pieces},
                severity=Severity.ERROR if pieces > 1 else None)


@check(Severity.WARNING,
       catches='names that are published with a leading slash',
       cause='a node or a tf_prefix that was written for ROS 1',
       fix='omit the slash: buffers remove it from received names, and refuse it in a lookup')
def leading_slash(case: Case) -> Iterator[Remark]:
    """Find names that were received with a leading slash."""
    if case.slashed:
        names = tuple(sorted(case.slashed))
        bare = {name.removeprefix('/') for name in names}
        edges = [edge for edge in case.edges if {*edge.frames} & bare]
        yield Remark(f'published with a leading slash: {listed(names)}', names,
                     publishers_of(*edges), {'names': len(names)})


@check(Severity.ERROR,
       catches='a transform with an empty frame name',
       cause='a message whose header.frame_id or child_frame_id was not set',
       fix='set both names; every buffer refuses such a transform')
def empty_name(case: Case) -> Iterator[Remark]:
    """Find transforms that the buffer refused for an empty name."""
    for (parent, child), trouble in case.of_kind(Kind.EMPTY_FRAME):
        frames = tuple(name for name in (parent, child) if name)
        beside = f'beside {frames[0]}' if frames else 'on both sides'
        yield of_trouble(frames, f'an empty frame name {beside}, {times(trouble.count)}', trouble)
