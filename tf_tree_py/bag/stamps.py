# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read the header stamps of any topic from the bytes, which begin with the header."""

from collections.abc import Callable
import struct

import numpy as np
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps

from .errors import BagError
from .files.bag_reader import Bag, PathLike
from .files.message_source import MessageSource
from .opening import Recording

_HEADER, _TIME = 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time'
# The offset of sec and nanosec: after CDR's encapsulation, or the seq of ROS 1's Header.
_PLACES = {(False, _HEADER): 4, (False, _TIME): 4, (True, _HEADER): 4, (True, _TIME): 0}


def stamps_of(bag: PathLike | Recording, topic: str) -> Stamps:
    """
    Return the stamps in the headers of a topic's messages, in order of arrival.

    The messages may have any type that begins with a Header or a Time. ``lookup_many`` accepts
    these stamps.

    :param bag: a path as for ``open_bag``, or its result.
    :return: (N,) nanoseconds.
    :raises BagError: the bag cannot be read, does not have the topic, or its messages do not
        begin with a stamp.
    """
    with Bag(bag.path if isinstance(bag, Recording) else bag, []) as opened:
        read = {source: _stamp_reader(source, opened) for source in opened.sources_of(topic)}
        stamps = [read[arrival.source](arrival.data) for arrival in opened.messages(topic)]
    return np.array(stamps, dtype=np.int64)


def _stamp_reader(source: MessageSource, bag: Bag) -> Callable[[bytes], int]:
    first = bag.first_field(source)
    place = _PLACES.get((source.ros1, first))
    what = f'{bag.path}: a message of {source.topic} ({source.type_name})'
    if place is None:
        raise BagError(f'{what} begins with {first or "an unknown field"}, and not with '
                       'a header')

    def read(data: bytes) -> int:
        form = '<II' if source.ros1 else ('<iI' if data[1:2] == b'\1' else '>iI')
        try:
            sec, nanosec = struct.unpack_from(form, data, place)
        except struct.error:
            raise BagError(f'{what} ends before its stamp') from None
        return int(sec * NANOSECONDS_PER_SECOND + nanosec)

    return read
