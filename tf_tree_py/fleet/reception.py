# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sorts the samples of Zenoh by robot, and puts those within each quota into an inbox.

It decodes no message: the receiver has to be faster than all senders. It reads only the data that
rmw_zenoh attaches to each message: its number, the time of sending, the sender. In Zenoh's
serialization these are three names, each followed by its value. Source:
``attachment_helpers.cpp`` of rmw_zenoh.
"""

from collections import Counter
from collections.abc import Callable
import struct
import time
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.text import shorten
from tf_tree_py.limited_log import LimitedLog

from .keys import Topic
from .requests import Gap, Request, sender_of
from .roster import Roster, Sender
from .session import needs_zenoh
from .transform_decoder import FleetMessage, Inbox

if TYPE_CHECKING:
    import zenoh

# A text and the bytes of an id begin with their length.
_LAYOUT = struct.Struct('<16sq17sq11s17s')
_NAMES = b'\x0fsequence_number', b'\x10source_timestamp', b'\x0asource_gid'


class Sending(NamedTuple):
    """
    How a sample was sent.

    :ivar sent: nanoseconds since 1970 by the sender's clock; None: unknown.
    :ivar sender: the publisher; None: unknown.
    :ivar number: one more than that of the publisher's previous message.
    :ivar by_zenoh: whether it is Zenoh that numbers the messages, and keeps them.
    """

    sent: int | None
    sender: Sender | None = None
    number: int = 0
    by_zenoh: bool = False


def read_attachment(data: bytes) -> Sending | None:
    """Return what the attached data says; None: it is something else."""
    if len(data) != _LAYOUT.size:
        return None
    first, number, second, sent, third, gid = _LAYOUT.unpack(data)
    return Sending(sent, (gid[1:].hex(), 0), number) if (first, second, third) == _NAMES else None


# --- reception

# The most parsed keys that are remembered for a robot, which needs two.
_MOST_KEYS = 8
_WAITS = 'more than can be decoded in time (waiting_bytes)'


class Reception:
    """Receives samples of Zenoh, from any thread."""

    def __init__(self, welcome: Callable[[str], Topic | None], roster: Roster,
                 inbox: Inbox, ask: Callable[[Request], object],
                 log: LimitedLog) -> None:
        """
        Begin with nothing.

        :param welcome: returns the topic of a key; None: the listener does not accept it.
        :param ask: sends a request for missing messages.
        :param log: of dropped messages.
        """
        self._log = log
        self._welcome = welcome
        self._ask = ask
        self._roster = roster
        self._inbox = inbox
        self._put = needs_zenoh().SampleKind.PUT
        self._topics: dict[str, Topic] = {}
        self._keys: Counter[str] = Counter()

    def receive(self, sample: 'zenoh.Sample') -> None:
        """Receive a message; the deletion of a key is ignored."""
        self.receive_from(None, sample)

    def receive_from(self, robot: str | None, sample: 'zenoh.Sample', *,
                     found: bool = False) -> None:
        """
        Receive a message.

        :param robot: the expected sender, because a reply may have any key; None: any.
        :param found: it was missing, and fills a gap.
        """
        key = str(sample.key_expr)
        topic = self._topics.get(key) or self._topic_of(key)
        if topic is None or robot not in (None, topic.robot):
            return
        size = len(sample.payload)
        # First, because it is fast: a flood must not delay others here.
        limit = self._roster.refusal(topic.robot, size)
        if limit:
            self._drop(topic.robot, limit)
        elif sample.kind == self._put:
            self._let_in(key, topic, sample, size, found)

    def find(self, robot: str, sample: 'zenoh.Sample') -> None:
        """Receive a message of a robot that was missing."""
        self.receive_from(robot, sample, found=True)

    def _topic_of(self, key: str) -> Topic | None:
        """Return the topic of a key, and remember it if it is accepted."""
        topic = self._welcome(key)
        if topic is not None and self._keys[topic.robot] < _MOST_KEYS:
            self._keys[topic.robot] += 1
            self._topics[key] = topic
        return topic

    def _let_in(self, key: str, topic: Topic, sample: 'zenoh.Sample', size: int, found: bool
                ) -> None:
        sending = _sending(sample)
        if found:
            self._roster.find(topic.robot)
        elif sending.sender is not None:
            self._number(key, topic, sending.sender, sending)
        late = found or sending.sent is not None and self._roster.is_late(
            topic.robot, sending.sent)
        message = FleetMessage(key, topic.static, sample.payload.to_bytes(),
                               0 if late else time.time_ns())
        for dropped in self._inbox.put(topic.robot, message, size):
            self._drop(dropped, _WAITS)

    def _number(self, key: str, topic: Topic, sender: Sender, sending: Sending) -> None:
        """Record the number of a message, and ask for those that are missing before it."""
        missing = self._roster.number(topic.robot, sender, sending.number, sending.by_zenoh)
        # A static message replaces those before it.
        if missing and sending.by_zenoh and not topic.static:
            self._ask(Gap(topic.robot, key, sender, missing, self.find))

    def _drop(self, robot: str, limit: str) -> None:
        """Count and log a message that is not decoded."""
        self._roster.drop(robot, limit)
        self._log.write(limit, robot, lambda: (
            f'messages of the robot {shorten(robot, 80)!r} are dropped (fleet.robots() counts '
            f'them): it sends {limit}'))


def _sending(sample: 'zenoh.Sample') -> Sending:
    stamp, info, attached = sample.timestamp, sample.source_info, sample.attachment
    sent = None if stamp is None else stamp.get_time_as_ntp64().as_nanos()
    if info is not None:
        return Sending(sent, sender_of(info.source_id), info.source_sn, True)
    found = None if attached is None else read_attachment(attached.to_bytes())
    if found is None:
        return Sending(sent)
    return found._replace(sent=sent) if sent else found
