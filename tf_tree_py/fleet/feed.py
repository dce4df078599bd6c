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

"""What one subscription hears, into the buffers."""

from collections.abc import Callable
import time
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.arrivals.frame_names import Rename
from tf_tree_py.core.arrivals.incident_log import IncidentLog
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.received import Received
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.arrivals.wire import WireReader
from tf_tree_py.core.buffer.buffer_core import BufferCore

from .attachment import read_attachment
from .keys import Topic
from .roster import Roster, Source
from .session import needs_zenoh
from .trust import without_others

if TYPE_CHECKING:
    import zenoh


# Whoever may write any key may invent some; more are not heard.
_MAX_KEYS = 50_000
_NOTHING = Batch((), (), ())


class Place(NamedTuple):
    """
    Where the transforms of one robot go.

    :ivar rename: what its frames are called there.
    :ivar shared: frames that it must not hang elsewhere.
    """

    buffer: BufferCore
    rename: Rename
    shared: frozenset[str]


class _Sender(NamedTuple):
    """One key that was heard, and what reads what comes under it."""

    robot: str
    static: bool
    place: Place
    reader: WireReader


class Feed:
    """Takes samples of Zenoh, in one thread."""

    def __init__(self, welcome: Callable[[str], tuple[Topic, Place] | None], roster: Roster,
                 log: IncidentLog) -> None:
        """
        Begin with nobody.

        :param welcome: returns of a key whose it is, and where that goes; None: nobody's.
        """
        self._welcome = welcome
        self._roster = roster
        self._log = log
        self._put = needs_zenoh().SampleKind.PUT
        # None: nobody's.
        self._senders: dict[str, _Sender | None] = {}

    def take(self, sample: 'zenoh.Sample') -> None:
        """Take a message; that a key was deleted says nothing of a transform."""
        key = str(sample.key_expr)
        sender = self._senders[key] if key in self._senders else self._begin(key)
        if sender is None or sample.kind != self._put:
            return
        sent, source, number = _sending(sample)
        late = sent is not None and self._roster.is_late(sender.robot, sent)
        batch = sender.reader.read_or_refuse(sample.payload.to_bytes(), sender.robot)
        if isinstance(batch, Incident):
            sender.place.buffer.intake.refuse(batch)
            incidents, batch = [batch], _NOTHING
        else:
            incidents = self._insert(sender, key, batch, sent if late else None)
        if incidents:
            self._log.report(incidents)
        refused, stamps = sum(incident.refused for incident in incidents), batch.stamps
        self._roster.take(
            sender.robot, max(0, len(stamps) - refused), refused,
            None if sender.static else max(stamps, default=None), late, source, number)

    def _begin(self, key: str) -> _Sender | None:
        if len(self._senders) >= _MAX_KEYS:
            return None
        welcome, sender = self._welcome(key), None
        if welcome is not None:
            topic, place = welcome
            sender = _Sender(*topic, place, WireReader(place.rename))
        self._senders[key] = sender
        return sender

    def _insert(self, sender: _Sender, key: str, batch: Batch, sent: int | None
                ) -> list[Incident]:
        """
        Insert a message; return what was refused or odd.

        :param sent: when, if it comes late: as if it had come then, whoever watches is told.
        """
        buffer, robot, static = sender.place.buffer, sender.robot, sender.static
        if buffer.observers.of_messages:
            buffer.observers.tell_received(
                Received(batch, sent or time.time_ns(), key, static, robot))
        own, incidents = without_others(batch, sender.place.shared, robot)
        for incident in incidents:
            buffer.intake.refuse(incident)
        return incidents + (buffer.insert_batch(own, robot, static) if own.edges else [])


def _sending(sample: 'zenoh.Sample') -> tuple[int | None, Source | None, int | None]:
    """
    Return when a sample was sent, by whom, and as which of its messages; None: nobody tells.

    Where Zenoh numbers messages, the number is None, for it tells by itself which are missed.
    """
    stamp, info, attached = sample.timestamp, sample.source_info, sample.attachment
    sent = None if stamp is None else stamp.get_time_as_ntp64().as_nanos()
    if info is not None:
        return sent, source_of(info.source_id), None
    attachment = None if attached is None else read_attachment(attached.to_bytes())
    if attachment is None:
        return sent, None, None
    return sent or attachment.sent, (attachment.gid, 0), attachment.number


def source_of(publisher: 'zenoh.EntityGlobalId') -> Source:
    """Return who a publisher is."""
    return str(publisher.zid), publisher.eid
