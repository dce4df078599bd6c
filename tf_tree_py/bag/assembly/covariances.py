# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recorded covariances of edges, by the same rules as live ones."""

from collections.abc import Callable, Iterator, Mapping
from typing import TypeAlias

from tf_tree_py.beyond.uncertainty.covariance_history import covariances_by_edge
from tf_tree_py.beyond.uncertainty.insertion import (
    Covariances,
    EdgeEstimate,
    estimate_in,
    not_moved,
)
from tf_tree_py.buffer_core import Snapshot
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.message_layout import as_published, Rename
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.recording.errors import BagError

from .assembler import Assembler
from ..files.bag_reader import Bag
from ..files.connections import Connection, decode

Heard: TypeAlias = tuple[EdgeEstimate | Incident, Covariances, str]


class CovarianceTopics:
    """
    The topics of a bag that contain covariances of edges.

    :ivar rules: the edge of each topic's covariances.
    :ivar connections: of these topics.
    """

    def __init__(self, bag: Bag, given: Mapping[str, Covariances] | None, alone: bool) -> None:
        """
        Find them in a bag; nothing is read.

        :param given: the rules of topics.
        :param alone: use only these topics; otherwise also the covariances of static edges.
        :raises BagError: the bag does not have one of them, or it has no covariances.
        """
        self._bag = bag
        self.rules = {} if alone else {each.topic: Covariances() for each in bag.everything
                                       if each.has_static_covariances}
        self.rules |= _checked_rules(given)
        self.connections = [each for topic in self.rules for each in bag.connections_of(topic)]
        for connection in self.connections:
            _check_type(bag, connection, self.rules[connection.topic])

    def insert_into(self, assembly: Assembler, rename_of: Callable[[Connection], Rename],
                    wanted: Callable[[str, str], bool], start: int | None, stop: int | None,
                    tell: Callable[[int], None]) -> None:
        """
        Insert the covariances of edges with transforms.

        :param rename_of: returns the new names for the frames of a connection.
        :param wanted: returns whether to take an edge, by its new names.
        :param start: skip messages received before it, nanoseconds; not of static edges.
        :param stop: skip messages received at it or later.
        :param tell: called with the number of messages read since.
        """
        for found, rules, authority in self.heard(
                Snapshot(assembly.tree), rename_of, start, stop, tell):
            if isinstance(found, Incident):
                assembly.refuse(found)
            elif wanted(found.parent, found.child):
                assembly.insert_estimate(found, rules.with_poses, authority)
        _note_strays(assembly)

    def heard(self, tree: Queries,
              rename_of: Callable[[Connection], Rename] = lambda _: as_published,
              start: int | None = None, stop: int | None = None,
              tell: Callable[[int], None] = lambda _: None) -> Iterator[Heard]:
        """
        Yield the estimate of each message, its rules, and the name of its sender.

        :param tree: has the transforms for the estimates that are moved.

        The other parameters are those of ``insert_into``.
        """
        # Those that are moved come last: their path may have its poses from another topic.
        for topic, rules in sorted(self.rules.items(), key=lambda each: each[1].edge is not None):
            connections = self._bag.connections_of(topic)
            static = any(connection.has_static_covariances for connection in connections)
            readers = {connection: self._reader(connection, rules, rename_of(connection), tree)
                       for connection in connections}
            for arrival in self._bag.messages(topic, *() if static else (start, stop)):
                tell(1)
                connection = arrival.connection
                yield readers[connection](arrival.data), rules, connection.authority

    def _reader(self, connection: Connection, rules: Covariances, names: Rename,
                tree: Queries) -> Callable[[bytes], EdgeEstimate | Incident]:
        """Return a function that reads a connection's messages to estimates or incidents."""
        authority = connection.authority

        def read(data: bytes) -> EdgeEstimate | Incident:
            try:
                said = estimate_in(decode(connection, data))
            except WireError as error:
                return Incident(Kind.MALFORMED, '', '', LATEST, authority,
                                f'{connection.topic}: {error}')
            parent, child = names(said.parent, said.child) or ('', '')
            estimate = rules.judged(said._replace(parent=parent, child=child), authority)
            if isinstance(estimate, Incident):
                return estimate
            return _moved(estimate, rules.carrier(estimate), tree, authority)

        return read


def _moved(estimate: EdgeEstimate, carrier: str | None, tree: Queries,
           authority: str) -> EdgeEstimate | Incident:
    """Return an estimate for the frame of its edge."""
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
    raise BagError("covariances has to be a dictionary of topics, such as {'/amcl_pose': "
                   "Covariances(child='base_link', edge=('map', 'odom'))}, "
                   f'not {given!r:.80}')


def _check_type(bag: Bag, connection: Connection, rules: Covariances) -> None:
    try:
        rules.check_type(connection.type_name)
    except ValueError as error:
        raise BagError(f'{bag.path}: covariances of {connection.topic}: {error}') from None


def _note_strays(assembly: Assembler) -> None:
    """Record covariances of edges without transforms: they would have no effect."""
    for (parent, child), known in covariances_by_edge(assembly.tree).items():
        history = assembly.tree.histories.get(child)
        if history is None or not history.has_named(parent):
            assembly.oddities.note(
                'covariances of no edge', 'no transform of this edge was recorded, so they are '
                'unused; name their edge with Covariances(child=..., edge=...)',
                (parent, child), times=len(known))
