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

"""Covariances that were recorded beside the transforms, by the rules of those that are heard."""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TypeAlias

from tf_tree_py.core.arrivals.cursor import WireError
from tf_tree_py.core.arrivals.estimate import Covariances, Estimate, not_moved
from tf_tree_py.core.arrivals.estimate_bytes import read_estimate
from tf_tree_py.core.arrivals.frame_names import as_published, Rename
from tf_tree_py.core.arrivals.incidents import Incident, Kind
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.queries import Queries, Snapshot

from .assembly import Assembly
from ..errors import BagError
from ..files.reading import Bag
from ..files.source import Source

Heard: TypeAlias = tuple[Estimate | Incident, Covariances, str]


class CovarianceTopics:
    """
    The topics of a bag that tell how far edges may be off.

    :ivar rules: to which edge those of each topic belong.
    """

    def __init__(self, bag: Bag, given: Mapping[str, Covariances] | None, alone: bool) -> None:
        """
        Find them in a bag; nothing is read.

        :param given: the rules of topics.
        :param alone: whether these are all; else also what is told of static edges.
        :raises BagError: the bag does not have one of them, or it has no covariances.
        """
        self._bag = bag
        self.rules = {} if alone else {source.topic: Covariances() for source in bag.everything
                                       if source.has_static_covariances}
        self.rules |= _checked_rules(given)
        self._names_its_child = {
            source: _names_its_child(bag, source, rules) for topic, rules in self.rules.items()
            for source in bag.sources_of(topic)}

    @property
    def sources(self) -> Collection[Source]:
        """Return where they come from."""
        return self._names_its_child

    def take_into(self, assembly: Assembly, rename_of: Callable[[Source], Rename],
                  wanted: Rename, start: int | None, stop: int | None,
                  tell: Callable[[int], None]) -> None:
        """
        Take them for edges whose transforms are there.

        :param rename_of: how the frames of a source are called.
        :param wanted: returns None of an edge to leave out, by its new name.
        :param start: leave out what was received before, nanoseconds; not of static edges.
        :param stop: leave out what was received then or later.
        :param tell: is called with how many messages were taken since.
        """
        for found, rules, authority in self.heard(
                Snapshot(assembly.tree), rename_of, start, stop, tell):
            if isinstance(found, Incident):
                assembly.refuse(found)
            elif wanted(found.parent, found.child):
                assembly.take_estimate(found, rules.with_poses, authority)
        _note_strays(assembly)

    def heard(self, tree: Queries, rename_of: Callable[[Source], Rename] = lambda _: as_published,
              start: int | None = None, stop: int | None = None,
              tell: Callable[[int], None] = lambda _: None) -> Iterator[Heard]:
        """
        Yield what each message says, by which rules, and who is named as its sender.

        :param tree: knows the ways of those that are moved.

        The other parameters are those of ``take_into``.
        """
        # Those that are moved come last: the way there may have its poses from another topic.
        for topic, rules in sorted(self.rules.items(), key=lambda each: each[1].edge is not None):
            sources = self._bag.sources_of(topic)
            static = any(source.has_static_covariances for source in sources)
            readers = {source: self._reader(source, rules, rename_of(source), tree)
                       for source in sources}
            for arrival in self._bag.messages(topic, *(None, None) if static else (start, stop)):
                tell(1)
                yield readers[arrival.source](arrival.data), rules, arrival.source.authority

    def _reader(self, source: Source, rules: Covariances, names: Rename,
                tree: Queries) -> Callable[[bytes], Estimate | Incident]:
        """Return what reads a source's messages: what they say of an edge, or what is wrong."""
        names_its_child, authority = self._names_its_child[source], source.authority

        def read(data: bytes) -> Estimate | Incident:
            try:
                said = read_estimate(data, names_its_child, source.ros1)
            except WireError as error:
                return Incident(Kind.MALFORMED, '', '', LATEST, authority,
                                f'{source.topic}: {error}')
            parent, child = names(said.parent, said.child) or ('', '')
            estimate = rules.judged(said._replace(parent=parent, child=child), authority)
            if isinstance(estimate, Incident):
                return estimate
            return _moved(estimate, rules.carrier(estimate), tree, authority)

        return read


def _moved(estimate: Estimate, carrier: str | None, tree: Queries,
           authority: str) -> Estimate | Incident:
    """Return an estimate of the frame that it is to tell of."""
    if carrier is None:
        return estimate
    try:
        return estimate.of(carrier, tree.lookup(estimate.child, carrier, estimate.stamp))
    except TransformException as error:
        return not_moved(estimate, carrier, error, authority)


def _checked_rules(given: Mapping[str, Covariances] | None) -> Mapping[str, Covariances]:
    given = {} if given is None else given
    if isinstance(given, Mapping) and all(
            isinstance(rules, Covariances) for rules in given.values()):
        return given
    raise BagError("covariances is a dictionary of topics, such as {'/amcl_pose': "
                   "Covariances(child='base_link', edge=('map', 'odom'))}, "
                   f'not {given!r:.80}')


def _names_its_child(bag: Bag, source: Source, rules: Covariances) -> bool:
    try:
        return rules.check_type(source.type_name)
    except ValueError as error:
        raise BagError(f'{bag.path}: covariances of {source.topic}: {error}') from None


def _note_strays(assembly: Assembly) -> None:
    """Note covariances of edges that nothing else tells of: nobody would ever see them."""
    for child, known in assembly.tree.uncertainty.items():
        history = assembly.tree.histories.get(child)
        if history is None or not history.has_named(known.parent):
            assembly.oddities.note(
                'covariances of no edge', 'no transform of it was recorded, so nothing asks for '
                'them; Covariances(child=..., edge=...) says to which edge they belong',
                (known.parent, child), times=len(known))
