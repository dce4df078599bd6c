# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Omits samples that interpolation can restore, because their frame hardly moves."""

from collections.abc import Iterable
from dataclasses import dataclass

from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.sample import Sample


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
        Take samples, and return those to send, those of each frame in the order of their stamps.

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
