# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The log line of a filter that drops every message: the cause, and the option that helps.

A filter that starts before its transforms, or drops a message now and then, logs nothing. A line
needs many drops in ten seconds without a message that passes. If the transforms only come late,
their delay is measured: a wait continues for some of the dropped messages, one after the other.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
import time
from typing import NamedTuple

from rclpy.node import Node
from tf_tree_py.core.errors import (
    ClockJumpException,
    FutureExtrapolationException,
    TransformException,
)
from tf_tree_py.core.stamp import as_seconds, format_span, from_seconds
from tf_tree_py.core.text import shorten
from tf_tree_py.limited_log import LimitedLog

from ..waiting.timeouts import Timeouts, Wait

# The fewest drops that cause a line, and how long they must last; a queue of more messages has to
# be lost as a whole.
_FEWEST, _PERIOD_S = 10, 10.0
# How long a wait continues for a dropped message, and for how many of them. The first does not
# count: its delay may be that of a node that has only just started.
_PATIENCE_S, _TRIALS = 5.0, 3
# More topics and frames than these are not distinguished; a message may have any frame.
_MOST_STREAMS = 100


class Arrival(NamedTuple):
    """
    A message of a filter.

    :ivar topic: '' if it came from no subscription of the filter.
    :ivar number: how many messages had come by then, with itself.
    :ivar at_s: when it came, by the clock of the buffer.
    """

    topic: str
    frame: str
    stamp: int
    number: int
    at_s: float


class _Trial(NamedTuple):
    """
    How long a dropped message was held, and what would have sufficed.

    :ivar held_s: seconds until it was dropped.
    :ivar delay_s: seconds until its transforms came.
    :ivar needed: how many messages had come by then, with itself.
    """

    held_s: float
    delay_s: float
    needed: int


@dataclass
class _Stream:
    """
    The messages of one topic and frame that were dropped since the last one that passed.

    :ivar next_s: when to look for the cause, by the monotonic clock.
    :ivar passed: how many messages have passed since the last one that was dropped.
    :ivar said: the causes that were logged.
    """

    began_s: float = 0.0
    next_s: float = 0.0
    count: int = 0
    passed: int = 0
    said: set[str] = field(default_factory=set)
    trials: list[_Trial] = field(default_factory=list)
    probe: '_Probe | None' = None

    def add(self) -> None:
        """Count a dropped message."""
        if self.count == 0:
            self.began_s = time.monotonic()
            self.next_s = self.began_s + _PERIOD_S
        self.count += 1
        self.passed = 0

    def restart(self) -> None:
        """Begin to count again; what was logged stays."""
        self.count = 0
        self.trials.clear()
        if self.probe is not None:
            self.probe.end()


class Losses:
    """
    What a filter has dropped since a message passed, by topic and frame.

    The filter's lock is held during all calls.

    :ivar names: the full names of topics, where they are known.
    """

    def __init__(self, node: Node, timeouts: Timeouts, lock: AbstractContextManager[object],
                 query: Callable[[str, int], object], targets: Sequence[str], queue_size: int,
                 timeout: int | None, tolerance: int) -> None:
        """
        Begin without losses.

        :param node: whose executor runs the callbacks, and whose logger writes the line.
        :param timeouts: of the buffer.
        :param lock: the filter's.
        :param query: looks up the transforms for a frame and a stamp.
        :param timeout: nanoseconds, as the tolerance.
        """
        self._node_name = node.get_name()
        self._log = LimitedLog(node.get_logger().warning)
        self._timeouts = timeouts
        self._lock = lock
        self._query = query
        self._targets = ' and '.join(map(repr, targets))
        self._queue_size = queue_size
        self._timeout = timeout
        self._tolerance = tolerance
        self._newest = 0
        self._streams: dict[tuple[str, ...], _Stream] = {}
        self.names: dict[str, str] = {}

    def arrived(self, topic: str, frame: str, stamp: int, number: int) -> Arrival:
        """Take note of a message."""
        self._newest = number
        return Arrival(topic, frame, stamp, number, self._now_s())

    def passed(self, arrival: Arrival) -> None:
        """Forget what was dropped before a message whose transforms are available."""
        key = arrival.topic, arrival.frame
        stream = self._streams.get(key)
        if stream is not None:
            stream.restart()
            stream.passed += 1
            if stream.passed == _FEWEST:
                del self._streams[key]

    def dropped(self, arrival: Arrival, cause: str = '', why: str = '') -> None:
        """
        Count a dropped message, and find the cause if none has passed for long.

        :param cause: a word for the reason for which its transforms can never come; '': they may
            still come.
        :param why: the same in a sentence.
        """
        stream = self._add(arrival.topic, arrival.frame)
        if not self._is_due(stream):
            return
        if cause:
            self._say(stream, arrival, cause, f'. The last one: {why}')
        elif stream.probe is None:
            self._ask(stream, arrival)
        elif time.monotonic() >= stream.probe.began_s + _PATIENCE_S:
            stream.probe.wait.expire()

    def not_called(self, arrival: Arrival) -> None:
        """Count a message that left the queue of the executor, which has never taken any."""
        stream = self._add(arrival.topic, arrival.frame, 'not called')
        if self._is_due(stream):
            self._say(
                stream, arrival, 'not called', ': their transforms have come, but the executor '
                f'of the node {self._node_name!r} has never called back. Is the node spinning? '
                'Does a callback of the same callback group never end?')

    def close(self) -> None:
        """Forget all losses."""
        for stream in self._streams.values():
            stream.restart()
        self._streams.clear()

    # --- the causes

    def _ask(self, stream: _Stream, arrival: Arrival) -> None:
        """Look for the cause; if the transforms may only be late, wait for them."""
        try:
            with self._timeouts.observers.quiet():
                self._query(arrival.frame, arrival.stamp)
        except FutureExtrapolationException:
            stream.probe = _Probe(self, stream, arrival, self._now_s() - arrival.at_s)
            stream.probe.wait.ask()
        except TransformException as error:
            self._say(stream, arrival, type(error).__name__, f'. The last one: {error}')

    def _came(self, stream: _Stream, arrival: Arrival, held_s: float) -> None:
        stream.trials.append(_Trial(
            held_s, self._now_s() - arrival.at_s, self._newest - arrival.number + 1))
        if len(stream.trials) == _TRIALS:
            self._say(stream, arrival, 'late', self._too_late(stream.trials[1:]))

    def _too_late(self, trials: Sequence[_Trial]) -> str:
        held, delay = (from_seconds(max(column)) for column in list(zip(*trials, strict=True))[:2])
        needed = max(trial.needed for trial in trials)
        cures = []
        if 0 < self._queue_size < needed:
            cures.append(f'a queue_size of at least {needed} instead of {self._queue_size}')
        if self._timeout is not None and self._timeout < delay:
            cures.append(f'a timeout of at least {format_span(delay)} instead of '
                         f'{format_span(self._timeout)}')
        beyond = (f'; the tolerance requires data {format_span(self._tolerance)} beyond their '
                  'stamps' if self._tolerance > 0 else '')
        # A wall_guard can end waits, too.
        cure = f'. Use {" and ".join(cures)}' if cures else ''
        return (f': their transforms came up to {format_span(delay)} after them, but they were '
                f'held for {format_span(held)} at most{beyond}{cure}')

    # --- streams

    def _add(self, *key: str) -> _Stream:
        if key not in self._streams and len(self._streams) >= _MOST_STREAMS:
            self._streams.pop(next(iter(self._streams))).restart()
        stream = self._streams.setdefault(key, _Stream())
        stream.add()
        return stream

    def _is_due(self, stream: _Stream) -> bool:
        return (stream.count >= max(_FEWEST, self._queue_size)
                and time.monotonic() >= stream.next_s)

    def _say(self, stream: _Stream, arrival: Arrival, cause: str, text: str) -> None:
        """Log a cause once, and look again later: the next cause may be another."""
        now = time.monotonic()
        stream.next_s = now + _PERIOD_S
        stream.trials.clear()
        if cause in stream.said:
            return
        stream.said.add(cause)
        lasted_s = now - stream.began_s
        topic = self.names.get(arrival.topic, arrival.topic)
        self._log.write(
            'dropping every message', topic,
            f'Dropped {stream.count} messages{topic and f" of {topic}"} in {lasted_s:.1f} s '
            f'({stream.count / lasted_s:.3g} Hz), and delivered none with a transform from '
            f'{shorten(arrival.frame, 80)!r} to {self._targets}{text}', arrival.frame)

    def _now_s(self) -> float:
        simulated = self._timeouts.watch.simulated_now()
        return time.monotonic() if simulated is None else as_seconds(simulated)


class _Probe:
    """A wait for the transforms of a message that was dropped."""

    def __init__(self, owner: Losses, stream: _Stream, arrival: Arrival, held_s: float) -> None:
        self._owner = owner
        self._stream = stream
        self._arrival = arrival
        self._held_s = held_s
        self.began_s = time.monotonic()
        self.wait = Wait(owner._timeouts, self, lambda: owner._query(arrival.frame, arrival.stamp),
                         None, owner._lock)

    def answered(self, _: object) -> None:
        """Note when the transforms came."""
        self.end()
        self._owner._came(self._stream, self._arrival, self._held_s)

    def failed(self, error: TransformException) -> None:
        """Log why they have not come; a jump of the clock or a closed listener is no reason."""
        self.end()
        if not isinstance(error, ClockJumpException) and not self.wait.released:
            self._owner._say(
                self._stream, self._arrival, type(error).__name__, f'. One of them: {error}')

    def end(self) -> None:
        """Stop waiting."""
        self.wait.end()
        self._stream.probe = None
