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

"""Why a message filter drops messages, and how many."""

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
    """Why a message was dropped."""

    EMPTY_FRAME = 'its frame_id is empty'
    IMPOSSIBLE_FRAME = 'its frame_id cannot be the name of a frame'
    TOO_OLD = 'its stamp is older than the buffer keeps'
    QUEUE_FULL = 'newer messages took its place in the queue'
    UNKNOWN_FRAME = 'nobody published one of the frames within the timeout'
    NOT_CONNECTED = 'nothing joined the frames within the timeout'
    NO_DATA = 'there was no data for its stamp within the timeout'
    CLOCK_JUMPED = 'the clock jumped back'
    CLOSED = 'the filter was closed, or the last listener of its buffer'


@dataclass(frozen=True)
class FilterStatistics:
    """
    Counts since a filter was made: received = delivered + all dropped + held.

    :ivar held: messages that wait now, for a transform or for the executor.
    """

    received: int
    delivered: int
    dropped: dict[Drop, int]
    held: int


def drop_for(error: TransformException, *, released: bool) -> Drop:
    """
    Return the reason for dropping a message whose lookup failed with an error.

    :param released: whether nobody delivers transforms any more.
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
