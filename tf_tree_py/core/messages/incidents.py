# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What can be wrong, or odd, about a transform that arrives.

By default no exception is raised: a listener must survive any bytes. An ``Incident``
describes what happened. It is counted, and returned to the caller that inserted it. The layers
above log it, at most once a second for each kind and each sender (``limited_log``).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from ..errors import TransformException
from ..stamp import LATEST
from ..text import LONGEST_TEXT, shorten


class Kind(Enum):
    """The kinds of incident; a transform with a kind in ``REMARKS`` was inserted."""

    MALFORMED = 'malformed message'
    EMPTY_FRAME = 'empty frame name'
    BAD_NAME = 'unusable frame name'
    SELF_EDGE = 'frame is its own parent'
    NOT_FINITE = 'NaN or infinity'
    ZERO_ROTATION = 'all-zero quaternion'
    IMPOSSIBLE_STAMP = 'impossible stamp'
    OLD_DATA = 'older than the buffer keeps'
    FAR_FUTURE = 'too far in the future'
    LOOP = 'would close a loop'
    BAD_COVARIANCE = 'unusable covariance'
    POSE_ALONE = 'covariance not used'
    TOO_MANY_FRAMES = 'too many frames'
    NOT_ITS_OWN = "another's frame"
    SECOND_PARENT = 'two publishers, two parents'
    TWO_PUBLISHERS = 'two publishers of one edge'
    KIND_CHANGE = 'change of kind'
    SILENT_EDGE_ENDED = 'silent edge ended'
    AHEAD_OF_CLOCK = 'ahead of the clock'
    JUMP_BACK = 'stamps jumped back'
    SOURCE_SILENT = 'source fell silent'
    SOURCE_DIVERGED = 'source diverged'
    SOURCE_PREFERRED = 'better source is back'


REMARKS = frozenset({Kind.POSE_ALONE, Kind.SECOND_PARENT, Kind.TWO_PUBLISHERS, Kind.KIND_CHANGE,
                     Kind.SILENT_EDGE_ENDED, Kind.AHEAD_OF_CLOCK, Kind.JUMP_BACK,
                     Kind.SOURCE_SILENT, Kind.SOURCE_DIVERGED, Kind.SOURCE_PREFERRED})


def count_refused(counts: Mapping[Kind, int]) -> int:
    """Return how many transforms were refused, from counts by kind."""
    return sum(count for kind, count in counts.items() if kind not in REMARKS)


class TransformWarning(UserWarning):
    """
    A transform that a program inserted was refused, or is odd.

    A buffer gives one warning for each kind.
    """


class RefusedException(TransformException):
    """
    The buffer refused transforms that a program inserted with ``strict=True``.

    :ivar incidents: the refused ones, each with its reason.
    """

    def __init__(self, *arguments: object, incidents: Sequence['Incident'] = ()) -> None:
        super().__init__(*arguments)
        self.incidents = list(incidents)


_ONE_OF = 'one of '
# With more publishers than this, the rest are only counted.
_MAX_CANDIDATES = 12
# An incident shows only the two ends of a longer name.
_LONGEST_NAME = 1024


def one_of(names: Collection[str]) -> str:
    """Return the authority of a transform that one of several publishers has sent."""
    if len(names) == 1:
        return next(iter(names))
    first = sorted(names)[:_MAX_CANDIDATES]
    more = len(names) - len(first)
    return _ONE_OF + ', '.join(first) + (f' and {more} more' if more else '')


def is_ambiguous(authority: str) -> bool:
    """Return whether an authority names several publishers, one of which is the sender."""
    return authority.startswith(_ONE_OF)


def candidates(authority: str) -> list[str]:
    """Return the publishers that an authority lists, without those that it only counts."""
    if not is_ambiguous(authority):
        return [authority] if authority else []
    names = authority.removeprefix(_ONE_OF).split(', ')
    return [*names[:-1], names[-1].partition(' and ')[0]]


@dataclass(frozen=True)
class Incident:
    """
    One transform that was refused, or inserted with a remark.

    The sender chose the names, so they may have any length; here they are shortened for the
    log.
    """

    kind: Kind
    parent: str
    child: str
    stamp: int
    authority: str
    detail: str
    """One sentence: the reason, what the buffer kept, and who is probably at fault."""
    newest: int = LATEST
    """The newest stamp of the edge, if the transform was refused for being older."""

    def __post_init__(self) -> None:
        for name, most in (('parent', _LONGEST_NAME), ('child', _LONGEST_NAME),
                           ('authority', LONGEST_TEXT), ('detail', LONGEST_TEXT)):
            text = getattr(self, name)
            if len(text) > most:
                # A frozen dataclass allows no other way to set a field.
                object.__setattr__(self, name, shorten(text, most))

    @property
    def refused(self) -> bool:
        """Return whether the transform was not inserted."""
        return self.kind not in REMARKS

    def __str__(self) -> str:
        verb = 'Refused' if self.refused else 'Note on'
        return (f'{verb} transform {self.parent!r} -> {self.child!r} from {self.authority!r} '
                f'({self.kind.value}): {self.detail}')


@dataclass
class Statistics:
    """
    Counts since the buffer was made; ``frames`` is the current number.

    :ivar accepted: transforms inserted.
    :ivar incidents: how often each kind happened; a refused message that cannot be
        parsed counts once.
    """

    accepted: int = 0
    incidents: dict[Kind, int] = field(default_factory=lambda: dict.fromkeys(Kind, 0))
    frames: int = 0

    @property
    def refused(self) -> int:
        """Return how many transforms were refused, of all kinds."""
        return count_refused(self.incidents)

    def __str__(self) -> str:
        text = f'{self.accepted} accepted, {self.refused} refused, {self.frames} frames'
        counts = [f'{kind.value}: {count}' for kind, count in self.incidents.items() if count]
        return '; '.join([text, *counts])
