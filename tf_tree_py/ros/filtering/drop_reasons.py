# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The reasons for which a message filter drops messages, and their counts."""

from dataclasses import dataclass
from enum import Enum

from tf_tree_py.core.errors import (
    ClockJumpException,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)


class Drop(Enum):
    """The reason for which a message was dropped."""

    EMPTY_FRAME = 'its frame_id is empty'
    IMPOSSIBLE_FRAME = 'its frame_id cannot be the name of a frame'
    TOO_OLD = 'its stamp is older than the buffer keeps'
    QUEUE_FULL = 'newer messages replaced it in the queue'
    UNKNOWN_FRAME = 'one of the frames was not published within the timeout'
    NOT_CONNECTED = 'the frames were not connected within the timeout'
    NO_DATA = 'there was no data for its stamp within the timeout'
    CLOCK_JUMPED = 'the clock jumped back'
    CLOSED = 'the filter was closed, or the last listener of its buffer'


@dataclass(frozen=True)
class FilterStatistics:
    """
    Counts since a filter was made: received = delivered + all dropped + held.

    :ivar held: messages that wait at the moment, for a transform or for the executor.
    """

    received: int
    delivered: int
    dropped: dict[Drop, int]
    held: int


def drop_for(error: TransformException, *, released: bool) -> Drop:
    """
    Return the reason for dropping a message whose lookup failed with an error.

    :param released: whether the last listener of the buffer has closed.
    """
    if isinstance(error, ClockJumpException):
        return Drop.CLOCK_JUMPED
    if isinstance(error, InvalidArgumentException):
        return Drop.IMPOSSIBLE_FRAME
    if released:
        return Drop.CLOSED
    if isinstance(error, LookupException):
        return Drop.UNKNOWN_FRAME
    if isinstance(error, ConnectivityException):
        return Drop.NOT_CONNECTED
    if isinstance(error, ExtrapolationException):
        return Drop.TOO_OLD if error.blocked_on is None else Drop.NO_DATA
    return Drop.CLOSED
