# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The texts about lookups that fail: the class of the error, and the hint what to do.

A hint is computed only when it is read. It is another one in a live buffer, where data may still
arrive, than in a recording: see ``Hint``.

It is read after the lookup, without the buffer's lock. So a hint gets copies of what it mentions,
such as the names of the frames, and never the tree.
"""

from collections.abc import Callable, Iterable
from functools import partial

from .errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    Hint,
    NoDataException,
    PastExtrapolationException,
)
from .stamp import format_span, SILENCE, unit_that_fits
from .text import known_names

_SPANNED = 'stamps_at_rate returns stamps for which all edges have data'
_UNCONNECTED = 'Tf has two or more unconnected trees'
_LISTS = 'tf_doctor lists the trees, and names that differ only in case or separators'


def no_sample(parent: str | None, child: str, stamp: int, oldest: int | None,
              newest: int | None, cache_time: int) -> ExtrapolationException:
    """Return the error of an edge of samples that has no pose at a stamp."""
    if oldest is None or newest is None:
        return NoDataException(child=child, requested=stamp)
    cls: type[ExtrapolationException] = ExtrapolationException
    hint: Callable[[bool], str] = _ended
    if stamp > newest:
        cls, hint = FutureExtrapolationException, partial(_too_new, stamp - newest)
    elif stamp < newest - cache_time:
        cls, hint = PastExtrapolationException, partial(_expired, cache_time)
    elif stamp < oldest:
        cls, hint = PastExtrapolationException, _too_old
    return cls(parent=parent, child=child, requested=stamp, oldest=oldest, latest=newest,
               hint=partial(_after_unit, stamp, oldest, newest, hint))


def _after_unit(stamp: int, oldest: int, newest: int, hint: Callable[[bool], str],
                live: bool) -> str:
    unit = unit_that_fits(stamp, oldest, newest)
    return f'{unit}. {hint(live)}' if unit else hint(live)


def _too_new(missing: int, live: bool) -> str:
    if not live:
        return f'This edge has no newer sample: look up an earlier stamp. {_SPANNED}'
    silent = ('. This edge has no samples in that interval: tf_doctor reports whether it is late, '
              'silent, or stamped by another clock')
    return ('Use a timeout that is long enough for the data to arrive. If this is the present '
            "time, pass the stamp of the sensor's own message instead"
            + (silent if missing > SILENCE else ''))


def _expired(cache_time: int, live: bool) -> str:
    sooner = 'look up sooner, or ' if live else ''
    return (f'The buffer keeps {format_span(cache_time)}: {sooner}use a longer cache_time '
            '(UNLIMITED keeps everything)')


def _too_old(live: bool) -> str:
    if live:
        return ('No older sample of this edge has arrived: its publisher or the listener started '
                'later')
    return f'This edge has no older sample: look up a later stamp. {_SPANNED}'


def _ended(live: bool) -> str:
    return ('The edge had ended at that time: it was silent, and another edge reversed it; '
            'tf_doctor names the publishers of both')


def unconnected(live: bool) -> str:
    """Return the hint about two frames in different trees."""
    why = 'which node should publish the edge between them?' if live else 'no edge joins them.'
    return f'{_UNCONNECTED}: {why} {_LISTS}'


def nothing_yet() -> str:
    """Return the hint in a live buffer that has no frame."""
    return 'Nothing has been received yet'


def unknown_frame(frame: str, names: Iterable[str], when_empty: str) -> Hint:
    """
    Return the hint about a frame name that no edge has.

    :param names: those of all frames.
    :param when_empty: the hint in a live buffer that has no frame.
    """
    return partial(_unknown, frame, tuple(names), when_empty)


def _unknown(frame: str, names: tuple[str, ...], when_empty: str, live: bool) -> str:
    if names:
        return known_names(frame, names)
    return when_empty if live else 'The buffer is empty'
