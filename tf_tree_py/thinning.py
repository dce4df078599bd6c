# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Outgoing transforms: which of many samples are sent, and when.

Moving samples are thinned out, by their rates and by the motion of their frames; static ones
are sent all together. The caller chooses the transport: a topic, or a link to another machine.
``core.messages.wire`` serializes the messages.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
import math
import threading
import time

from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND


@dataclass(slots=True)
class _Frame:
    """
    The last sent sample of a frame, and the sample held back since then.

    :ivar sent: the last sample that was sent.
    :ivar turn: when the next one is sent at the latest.
    :ivar held: the newest sample since then, which was held back.
    """

    sent: Sample
    turn: float
    held: Sample | None = None


class DeadBand:
    """
    Sends a sample of a frame if the frame has moved since the last sample that was sent.

    It has moved if it is further than ``min_move`` or ``min_turn`` from that sample, or has
    another parent. If the previous sample was held back, it is sent as well: otherwise
    interpolation between the two sent samples would show a slow motion instead of a rest. If
    nothing was sent for ``max_silence``, the next sample is sent in any case, and so is a
    sample that is held back at that time. So the last pose of a frame always arrives. This is
    the boxcar algorithm of data historians: Hale, Sellars, "Historical data recording for
    process computers", Chemical Engineering Progress 77 (1981), with distances of poses in
    place of differences.

    While stamps increase, and measured by ``se3.distance``:

    - the newest sent pose is within the thresholds of the newest received pose;
    - at the stamp of any sample, the interpolation between the sent samples is within twice
      the thresholds of that sample. If samples were held back between two sent ones, each of
      them, and each interpolated pose between the two, is within the thresholds of the first.
      The rest follows from the triangle inequality.

    While stamps decrease, no sample is held back. A sample costs O(1), and only the frames of
    the last ``max_silence`` take memory. The caller provides the clock.
    """

    def __init__(self, min_move: float, min_turn: float, max_silence: float) -> None:
        """
        Start without samples.

        :param min_move: metres.
        :param min_turn: radians.
        :param max_silence: nanoseconds.
        """
        self._min_move = min_move
        self._min_turn = min_turn
        self._max_silence = max_silence
        # In the order of their turns: each is appended at the end, because time only advances.
        self._frames: dict[str, _Frame] = {}

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None if no sample is held back."""
        return next((frame.turn for frame in self._frames.values()), None)

    def offer(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        """
        Accept samples, and return those to send, those of each frame in the order of their stamps.

        :param now: nanoseconds of a clock that never goes back.
        """
        return [went for sample in samples for went in self._offer(sample, now)]

    def due(self, now: int) -> list[Sample]:
        """Return the samples that were held back long enough."""
        over = []
        for child, frame in self._frames.items():
            if frame.turn > now:
                break
            over.append(child)
        held = [self._frames.pop(child).held for child in over]
        return [self._sent(sample, now) for sample in held if sample is not None]

    def _offer(self, sample: Sample, now: int) -> list[Sample]:
        frame = self._frames.get(sample.child)
        if frame is None:
            return [self._sent(sample, now)]
        newest = frame.held or frame.sent
        if sample.stamp < newest.stamp:
            del self._frames[sample.child]
            return [sample] if frame.held is None else [frame.held, sample]
        if self._moved(frame.sent, sample):
            last = [] if frame.held is None else [frame.held]
            return [*last, self._sent(sample, now)]
        if frame.turn <= now:
            return [self._sent(sample, now)]
        frame.held = sample
        return []

    def _moved(self, sent: Sample, sample: Sample) -> bool:
        way, angle = se3.distance(sent.pose, sample.pose)
        return sent.parent != sample.parent or way > self._min_move or angle > self._min_turn

    def _sent(self, sample: Sample, now: int) -> Sample:
        self._frames.pop(sample.child, None)
        self._frames[sample.child] = _Frame(sample, now + self._max_silence)
        return sample


# --- rates

class RateLimit:
    """
    Sends at most one sample of each frame in a period: the newest.

    A sample that arrives after a pause is sent at once. One that arrives too early waits for
    its frame's turn, or is replaced by a newer one. So the last pose of a frame that stops
    moving is never lost. A sample costs O(1), and only the frames of the last period take
    memory. The caller provides the clock.
    """

    def __init__(self, period: float) -> None:
        """
        Start without samples.

        :param period: nanoseconds.
        """
        self._period = period
        # When each frame may be sent again, the earliest first: each is appended at the end,
        # because time only advances.
        self._turns: dict[str, float] = {}
        self._waiting: dict[str, Sample] = {}

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None if no sample waits."""
        return next(iter(self._turns.values()), None)

    def offer(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        """
        Accept samples, and return those to send at once.

        :param now: nanoseconds of a clock that never goes back.
        """
        going: dict[str, Sample] = {}
        for sample in samples:
            child = sample.child
            if self._turns.get(child, now) <= now or child in going:
                going[child] = _newer(sample, going.get(child) or self._waiting.pop(child, None))
                self._next_turn_of(child, now)
            else:
                self._waiting[child] = _newer(sample, self._waiting.get(child))
        return list(going.values())

    def due(self, now: int) -> list[Sample]:
        """Return the waiting samples whose turn has come."""
        over = []
        for child, turn in self._turns.items():
            if turn > now:
                break
            over.append(child)
        going = []
        for child in over:
            del self._turns[child]
            if child in self._waiting:
                going.append(self._waiting.pop(child))
                self._next_turn_of(child, now)
        return going

    def _next_turn_of(self, child: str, now: int) -> None:
        self._turns.pop(child, None)
        self._turns[child] = now + self._period


def _newer(sample: Sample, other: Sample | None) -> Sample:
    return sample if other is None or sample.stamp >= other.stamp else other


# --- dead band and rates together

class Thinner:
    """
    Selects a part of all samples: first by each frame's rate, then by its motion.

    The error of the receiver's interpolation is at most the sum of two bounds. The dead band
    contributes twice its thresholds (``DeadBand``). The rate limit contributes the error of
    linear interpolation, a T^2/8 for an acceleration a and samples that are T apart
    (de Boor, "A Practical Guide to Splines", chapter III). T is the period of the limit plus
    that of the frame. The caller provides the clock.
    """

    def __init__(self, *, rate_hz: float = 0.0, rates: Mapping[str, float] | None = None,
                 min_move: float = 0.0, min_turn: float = 0.0, max_silence: float = 1.0) -> None:
        """
        Start without samples.

        :param rate_hz: the maximum rate of each frame; 0: no limit.
        :param rates: the same for single frames, by the child of their edge.
        :param min_move: a frame that moves less than this is at rest, metres. If this and
            ``min_turn`` are 0, frames at rest are sent too.
        :param min_turn: the same for the rotation, radians.
        :param max_silence: seconds after which a frame at rest is sent anyway.
        :raises ValueError: one of them is invalid.
        """
        self._rate_hz = _checked('rate_hz', rate_hz)
        self._rates = {frame: _checked(f'the rate of {frame!r}', rate)
                       for frame, rate in (rates or {}).items()}
        self._pacings = {rate: RateLimit(NANOSECONDS_PER_SECOND / rate)
                         for rate in (self._rate_hz, *self._rates.values()) if rate}
        thresholds = _checked('min_move', min_move), _checked('min_turn', min_turn)
        if not _checked('max_silence', max_silence):
            raise ValueError('max_silence must be greater than zero')
        self._dead_band = DeadBand(
            *thresholds, max_silence * NANOSECONDS_PER_SECOND) if any(thresholds) else None

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None if no sample waits."""
        stages = (*self._pacings.values(), *([self._dead_band] if self._dead_band else ()))
        return min((stage.next_turn for stage in stages if stage.next_turn is not None),
                   default=None)

    def offer(self, samples: Collection[Sample], now: int) -> Collection[Sample]:
        """
        Accept samples, and return those to send at once.

        :param now: nanoseconds of a clock that never goes back.
        """
        paced = self._paced(samples, now) if self._pacings else samples
        return paced if self._dead_band is None else self._dead_band.offer(paced, now)

    def due(self, now: int) -> Collection[Sample]:
        """Return the waiting samples whose turn has come."""
        paced = [sample for pacing in self._pacings.values() for sample in pacing.due(now)]
        if self._dead_band is None:
            return paced
        return [*self._dead_band.offer(paced, now), *self._dead_band.due(now)]

    def _paced(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        by_rate = defaultdict[float, list[Sample]](list)
        for sample in samples:
            by_rate[self._rates.get(sample.child, self._rate_hz)].append(sample)
        return [sample for rate, group in by_rate.items()
                for sample in (self._pacings[rate].offer(group, now) if rate else group)]


def _checked(what: str, number: float) -> float:
    if not 0.0 <= number < math.inf:
        raise ValueError(f'{what} must be a finite number, zero or greater, not {number!r}')
    return number


# --- sending

# Sends one message; it must not raise.
Send = Callable[[Collection[Sample]], None]


class MovingSender:
    """
    Sends moving transforms, thinned out.

    ``offer`` is thread-safe. Samples that must wait are sent by an internal thread, which
    sleeps while none waits.
    """

    def __init__(self, send: Send, thinning: Thinner) -> None:
        """Start the internal thread, which runs until ``close``."""
        self._send_message = send
        self._thinning = thinning
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(
            target=self._send_what_waited, name='thinning', daemon=True)
        self._thread.start()

    @property
    def next_turn(self) -> float:
        """Return when the thread sends next, by the monotonic clock; infinity if none waits."""
        with self._changed:
            turn = self._thinning.next_turn
            return math.inf if turn is None else turn

    def offer(self, samples: Collection[Sample]) -> None:
        """Accept samples, and send each at once, at its frame's turn, or not at all."""
        with self._changed:
            if self._closed:
                return
            before = self.next_turn
            self._send(self._thinning.offer(samples, time.monotonic_ns()))
            if self.next_turn < before:
                self._changed.notify()

    def close(self) -> None:
        """Stop the thread; samples that still wait are not sent."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _send_what_waited(self) -> None:
        with self._changed:
            while not self._closed:
                now = time.monotonic_ns()
                self._send(self._thinning.due(now))
                self._changed.wait(min(
                    (self.next_turn - now) / NANOSECONDS_PER_SECOND, threading.TIMEOUT_MAX))

    def _send(self, samples: Collection[Sample]) -> None:
        if samples:
            self._send_message(samples)


class StaticSender:
    """Sends all static transforms together, for late subscribers; thread-safe."""

    def __init__(self, send: Send) -> None:
        """Begin without transforms."""
        self._send_message = send
        self._lock = threading.Lock()
        self._latest: dict[str, Sample] = {}

    def offer(self, samples: Collection[Sample]) -> None:
        """Send all samples, after replacing those of the same children by these."""
        with self._lock:
            for sample in samples:
                # Every message contains all of them: a faulty publisher must not make it grow
                # without limit.
                if sample.child in self._latest or len(self._latest) < DEFAULT_MAX_FRAMES:
                    self._latest[sample.child] = sample
            if samples:
                self._send_message(self._latest.values())
