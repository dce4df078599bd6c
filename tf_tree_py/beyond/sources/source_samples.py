# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples of several sources of one edge, as received: the part that a file contains."""

from collections.abc import Mapping
from typing import NamedTuple

from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.stamp import BEGINNING, FOREVER
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Arrays, Facts, load_samples, save_samples, Saved

from ..corrections.corrected import CorrectedSamples


class EdgeSource(NamedTuple):
    """
    A description of one of several sources of an edge.

    :ivar newest: its newest stamp, nanoseconds.
    :ivar is_active: whether lookups use it, or will use it once it has reached the edge.
    :ivar made_way: why the rule last replaced it; None if it did not, or if it is in use again.
    """

    name: str
    newest: int
    is_active: bool
    made_way: Incident | None = None


class SourceSamples:
    """
    The samples of each source of one edge; sources that sent earlier are preferred.

    :ivar histories: of each source, by name.
    :ivar active: the source that lookups use, or will use.
    :ivar answering: the source whose samples the tree has; it differs from the active one while
        the tree waits for that.
    :ivar made_way: why the rule last replaced sources, by name.
    """

    def __init__(self, parent: str, child: str) -> None:
        self.parent, self.child = parent, child
        self.histories: dict[str, Samples] = {}
        self.active = self.answering = ''
        self.made_way: dict[str, Incident] = {}

    def clear(self) -> None:
        """Remove all samples; the next source that sends becomes the active one."""
        self.histories.clear()
        self.made_way.clear()
        self.active = self.answering = ''

    def listed(self) -> list[EdgeSource]:
        """Return a description of each source, the preferred ones first."""
        return [EdgeSource(name, _newest(history), name == self.active, self.made_way.get(name))
                for name, history in self.histories.items()]

    def smoothed(self, edge: History) -> Samples | None:
        """
        Return all samples of the source in use, with their corrections applied.

        :param edge: the history in the tree; None is returned if it needs no replacement.
        """
        if not isinstance(edge, CorrectedSamples) or not len(edge) or (
                self.answering not in self.histories):
            return None
        plain = self.histories[self.answering].copy()
        plain.interpolate_by(edge.interpolation.copy())
        stamps, poses = plain.copy_between(BEGINNING, FOREVER - 1)
        correction = edge.corrections.get(self.parent)
        if correction is not None:
            plain.set_poses(correction.measured.smoothed(stamps, poses))
        return plain

    # --- copies and files

    def copy(self) -> 'SourceSamples':
        """Return a copy."""
        twin = SourceSamples(self.parent, self.child)
        twin.histories = {name: history.copy() for name, history in self.histories.items()}
        twin.active, twin.answering = self.active, self.answering
        twin.made_way = dict(self.made_way)
        return twin

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the samples in the windows to arrays."""
        return {'parent': self.parent, 'child': self.child, 'active': self.active,
                'answering': self.answering,
                'made_way': [[one.kind.name, str(one.stamp), name, one.detail]
                             for name, one in self.made_way.items()],
                'sources': [{'name': name} | save_samples(history, arrays)
                            for name, history in self.histories.items()]}

    @classmethod
    def load(cls, saved: Saved) -> 'SourceSamples':
        """
        Return the saved sources; they use the memory in place and take no samples.

        :raises ValueError: the facts are not valid for sources.
        """
        one = cls(saved.one('parent', str), saved.one('child', str))
        one.active, one.answering = saved.one('active', str), saved.one('answering', str)
        for row in saved.many('made_way', list):
            if [type(value) for value in row] != [str] * 4 or row[0] not in Kind.__members__:
                raise ValueError("'made_way' is not a list of incidents")
            one.made_way[row[2]] = Incident(Kind[row[0]], one.parent, one.child, int(row[1]),
                                            row[2], row[3])
        for part in saved.parts('sources'):
            history = load_samples(Samples, one.child, part)
            if history.newest_stamp is None:
                raise ValueError("'sources' has one without samples")
            one.histories[part.one('name', str)] = history
        return one


class Sources(Companion):
    """
    The sources of a tree's edges.

    :ivar by_child: the samples of edges that have several sources, by child frame.
    """

    key = 'sources'

    def __init__(self) -> None:
        self.by_child: dict[str, SourceSamples] = {}

    def copy(self) -> 'Sources':
        """Return an independent copy."""
        twin = Sources()
        twin.by_child = {child: one.copy() for child, one in self.by_child.items()}
        return twin

    def clear(self, histories: Mapping[str, History]) -> None:
        """Remove all samples."""
        for sources in self.by_child.values():
            sources.clear()

    def remove(self, frame: str) -> None:
        """Remove the sources of a frame's edge."""
        self.by_child.pop(frame, None)

    def save(self, arrays: Arrays) -> list[Facts]:
        """Return the facts for ``load``, and add the samples in the windows to arrays."""
        return [sources.save(arrays) for sources in self.by_child.values()]

    @classmethod
    def load(cls, saved: Saved) -> 'Sources':
        """Return the saved sources; they use the memory in place and take no samples."""
        twin = cls()
        for part in saved.parts(cls.key):
            sources = SourceSamples.load(part)
            twin.by_child[sources.child] = sources
        return twin


def sources_by_child(tree: Tree) -> Mapping[str, SourceSamples]:
    """Return the sources of each edge that has several, by child frame."""
    known = tree.companion(Sources)
    return {} if known is None else known.by_child


def _newest(history: Samples) -> int:
    assert history.newest_stamp is not None
    return history.newest_stamp
