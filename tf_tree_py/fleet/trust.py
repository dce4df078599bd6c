# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a robot may publish: which frames, and how much.

It may publish its own frames without restriction, and none of others. Only the key can be checked
on arrival; a router's access control may restrict a robot to its keys. Therefore the frames are
put below the robot that the key names. A quota limits the messages of one robot, so that it cannot
use up the resources of others.
"""

from collections.abc import Collection
from dataclasses import dataclass, fields

from tf_tree_py.core.errors import no_truth
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.sample import Batch

from .session import FleetError


def checked_shared(frames: Collection[str]) -> frozenset[str]:
    """
    Return the frames that all robots share, without leading slashes.

    :raises FleetError: a string instead of a collection of frames.
    """
    if isinstance(frames, str):
        raise FleetError(f'shared_frames has to be a collection, such as ({frames!r},)')
    return frozenset(frame.removeprefix('/') for frame in frames)


def names_below(robot: str, shared: frozenset[str]) -> Rename:
    """Return a function that puts a robot's frames below it; those already there stay."""
    prefix = f'{robot}/'

    def frame(name: str) -> str:
        name = name.removeprefix('/')
        # An empty name stays empty, so that it is refused later.
        kept = not name or name in shared or name.startswith(prefix)
        return name if kept else prefix + name

    return lambda parent, child: (frame(parent), frame(child))


def without_others(batch: Batch, shared: frozenset[str], robot: str
                   ) -> tuple[Batch, list[Incident]]:
    """
    Return a message without edges that attach a shared frame elsewhere, and their incidents.

    :param batch: its frames are below its robot.
    """
    if all(child not in shared for _, child in batch.edges):
        return batch, []
    own = [place for place, (_, child) in enumerate(batch.edges) if child not in shared]
    refused = [_refused(*edge, stamp, robot) for edge, stamp
               in zip(batch.edges, batch.stamps, strict=True) if edge[1] in shared]
    return batch.part(own), refused


def _refused(parent: str, child: str, stamp: int, robot: str) -> Incident:
    return Incident(
        Kind.NOT_ITS_OWN, parent, child, stamp, robot,
        f'{child!r} is shared by all robots: a robot may attach its frames below it, but not '
        'attach it elsewhere. Do not publish this edge on the robot, or insert it here yourself')


# --- how much a robot may publish

# A robot may send this many seconds' worth at once: its stored messages arrive in one burst.
_BURST_S = 10.0
_MAX_NAME_BYTES = 1_000_000
# The time for which all messages of a robot are dropped after it exceeded its quota.
_SHUT_S = 0.02


@dataclass(frozen=True)
class RobotQuota:
    """
    The limits for each robot; messages beyond them are dropped or refused, and counted.

    The defaults are about ten times what a robot with 100 frames at 50 Hz sends.

    :ivar messages_per_s: sustained; ten seconds' worth may come at once.
    :ivar bytes_per_s: likewise.
    :ivar largest_message: bytes.
    :ivar waiting_bytes: of messages that have arrived and are not decoded yet.
    :ivar frames: names of frames, apart from the shared ones.
    :ivar decoding_share: of one processor's time, sustained; likewise.
    :ivar names: of robots, below one first part of a name, such as ``robot7/``: a router can
        confine a robot to such names, of which it may invent many. Below a longer beginning, such
        as ``site/robot7/``, there may be a tenth of that.
    """

    messages_per_s: float = 1_000.0
    bytes_per_s: float = 4_000_000.0
    largest_message: int = 256 * 1024
    waiting_bytes: int = 4_000_000
    frames: int = 5_000
    decoding_share: float = 0.1
    names: int = 100

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, int | float) or isinstance(value, bool) or not value > 0:
                raise FleetError(f'{field.name} of a quota has to be above 0, not {value!r}')
        if self.waiting_bytes < self.largest_message:
            raise FleetError('waiting_bytes of a quota has to be at least its largest_message')


class Allowance:
    """
    The remaining quota of a robot: three token buckets, and the largest message.

    Not thread-safe.
    """

    def __init__(self, quota: RobotQuota, now: float) -> None:
        """Begin with full buckets; ``now`` is in seconds of a monotonic clock."""
        self._quota = quota
        self._then = now
        self._messages = self._most_messages = quota.messages_per_s * _BURST_S
        self._bytes = self._most_bytes = quota.bytes_per_s * _BURST_S
        self._decoding = self._most_decoding = quota.decoding_share * _BURST_S
        # Until then messages are refused without any computation; and the reason.
        self._shut_until, self._why = now, ''
        self._too_large = f'a message of more than {quota.largest_message} bytes (largest_message)'
        self._too_many = f'more than {quota.messages_per_s:g} messages a second (messages_per_s)'
        self._too_much = f'more than {quota.bytes_per_s:g} bytes a second (bytes_per_s)'
        self._too_costly = (f'more than {100 * quota.decoding_share:g} % of a processor can '
                            'decode (decoding_share)')

    def refusal(self, size: int, now: float) -> str:
        """Subtract a message of this many bytes; return which limit it exceeds, or ''."""
        if now < self._shut_until:
            return self._why
        quota, passed = self._quota, max(0.0, now - self._then)
        self._then = now
        self._messages = min(self._most_messages, self._messages + passed * quota.messages_per_s)
        self._bytes = min(self._most_bytes, self._bytes + passed * quota.bytes_per_s)
        self._decoding = min(self._most_decoding, self._decoding + passed * quota.decoding_share)
        if size > quota.largest_message:
            return self._too_large
        self._why = (self._too_many if self._messages < 1 else self._too_much
                     if self._bytes < size else self._too_costly if self._decoding < 0 else '')
        if self._why:
            self._shut_until = now + _SHUT_S
            return self._why
        self._messages -= 1
        self._bytes -= size
        return ''

    def spend(self, seconds: float) -> None:
        """Subtract the processor time of a decoded message."""
        self._decoding -= seconds


class FrameQuota:
    """
    The frame names that a robot has used, and how many more it may use.

    Not thread-safe, except for its length.
    """

    def __init__(self, most: float) -> None:
        """Begin without frames."""
        self._most = most
        self._frames: set[str] = set()
        self._name_bytes = 0

    def __len__(self) -> int:
        return len(self._frames)

    __bool__ = no_truth

    def admitted(self, batch: Batch, shared: Collection[str]) -> Batch:
        """Return a message without the edges whose frames exceed the quota."""
        known = self._frames
        if all(parent in known and child in known for parent, child in batch.edges):
            return batch
        kept = [place for place, edge in enumerate(batch.edges) if self._admits(edge, shared)]
        if len(kept) == len(batch.edges):
            return batch
        return batch.part(kept)

    def _admits(self, edge: tuple[str, str], shared: Collection[str]) -> bool:
        new = {frame for frame in edge if frame not in self._frames and frame not in shared}
        # One unusual character makes all characters of a string four bytes wide.
        size = 4 * sum(map(len, new))
        if len(self._frames) + len(new) > self._most or self._name_bytes + size > _MAX_NAME_BYTES:
            return False
        self._frames |= new
        self._name_bytes += size
        return True
