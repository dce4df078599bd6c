# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One topic that fills a buffer: its subscription, the names of its publishers, and their messages.

What a message of any type means is a matter of subclasses. All share the rest: observers see each
message, incidents name its publisher, and two publishers of one edge are noticed.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
import functools
from typing import Any, cast

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.message_layout import Rename, STEP
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import WireReader

from .endpoints import DuplicatePublishers, PublisherNames
from .qos import mismatches, overriding
from .spinner import Spinner
from ..buffer.buffer import Buffer
from ..threads.backlog import Backlog

# Reading a layout for the first time, and adding its frames, takes some 20 us a transform. Larger
# messages are read in steps.
_LARGE_BYTES = 100_000

Info = Mapping[str, int | None]
"""rclpy's message info."""


class Feed:
    """Stores the messages of one topic in the buffer."""

    def __init__(self, buffer: Buffer, node: Node, topic: str, static: bool,
                 spinner: Spinner) -> None:
        """
        Begin without a subscription.

        :param static: whether its transforms are valid at all times.
        :param spinner: notes that the node is spun.
        """
        self._buffer = buffer
        self._node = node
        self._static = static
        self._spinner = spinner
        self._topic = topic
        self._authority = PublisherNames(node, topic)
        self._duplicates = DuplicatePublishers(self._authority, static)
        buffer.feeds.name_later(self._authority.placeholder, self._authority.name)

    def _subscribe(self, msg_type: type, callback: Callable[[Any, Info], None],
                   qos: QoSProfile | int, raw: bool = False) -> None:
        # In a separate callback group: another callback of the node may block on a lookup.
        subscribe = functools.partial(
            self._node.create_subscription, msg_type, self._topic, cast('Any', callback), qos,
            raw=raw, callback_group=MutuallyExclusiveCallbackGroup(),
            qos_overriding_options=overriding(
                self._node, self._topic, 'subscription', self._static))
        log = self._buffer.feeds.log
        try:
            self._subscription = subscribe(event_callbacks=mismatches(
                self._topic, log, self._duplicates.forget_for_a_while))
        except UnsupportedEventTypeError:  # the middleware does not report who leaves
            self._subscription = subscribe(event_callbacks=mismatches(self._topic, log))
        self._buffer.feeds.topics[self._topic] = None

    def close(self) -> None:
        """Stop receiving; needed where the subscription is on the user's node."""
        self._node.destroy_subscription(self._subscription)

    def report_settled(self) -> None:
        """Report edges of two publishers, of which it is known by now that none had left."""
        self._report(self._duplicates.settled())

    def _report(self, rivalries: Iterable[Incident]) -> None:
        for rivalry in rivalries:
            self._buffer.feeds.refuse(rivalry)

    def _refuse(self, incident: Incident) -> None:
        self._buffer.feeds.refuse(*self._authority.correct([incident]))

    def _announce(self, batch: Batch, is_new: bool) -> str:
        """
        Notify the observers of a message; return its publisher.

        :param is_new: whether its layout is new. Its publisher may then have started after the
            last query of the graph, and would be taken for the only one before.
        """
        authority = self._authority.present_name() if is_new else self._authority.name()
        if self._buffer.observers.of_messages:
            self._buffer.observers.notify_received(ReceivedMessage(
                batch, self._buffer.now(), self._topic, self._static,
                '' if authority == self._authority.placeholder else authority))
        return authority

    def _insert(self, batch: Batch, authority: str) -> None:
        incidents = self._buffer.insert_batch(batch, authority, self._static, announced=True)
        self._buffer.feeds.note(self._authority.correct(incidents))


class TransformFeed(Feed):
    """Stores the messages of ``/tf`` or ``/tf_static``, which it reads as bytes."""

    def __init__(self, buffer: Buffer, node: Node, topic: str, static: bool, qos: QoSProfile | int,
                 names: Rename, spinner: Spinner, backlog: Backlog | None = None) -> None:
        """
        Begin to receive.

        :param names: the new names of an edge.
        :param backlog: gets large messages of new layouts; None: they are read at once.
        """
        super().__init__(buffer, node, topic, static, spinner)
        self._backlog = backlog
        self._reader = WireReader(names, static=static)
        self._subscribe(TFMessage, self._receive, qos, raw=True)

    def _receive(self, data: bytes, info: Info) -> None:
        self._spinner.note()
        batch: Batch | Incident | None = None
        backlog = self._backlog if len(data) > _LARGE_BYTES else None
        if backlog is None or not len(backlog):  # large messages keep their order
            batch = self._reader.read_known(data)
        is_new = batch is None
        if batch is None:
            if backlog is not None:
                backlog.add(self._receive_in_steps(data), len(data))
                return
            batch = self._reader.read_or_refuse(data, self._authority.name())
        if isinstance(batch, Incident):
            self._refuse(batch)
        elif batch.edges or batch.impossible:
            self._insert(batch, self._announce(batch, is_new))
            self._report(self._duplicates.judge(batch, info))

    def _receive_in_steps(self, data: bytes) -> Iterator[None]:
        """
        Store a large message of a new layout, or one that waits behind such a message.

        Its number is not compared with others: small messages may have overtaken it.
        """
        batch = yield from self._reader.read_in_steps(data, self._authority.name())
        if isinstance(batch, Incident):
            self._refuse(batch)
        elif batch.edges or batch.impossible:
            authority = self._announce(batch, True)
            for part in batch.parts(STEP):
                yield
                self._insert(part, authority)
