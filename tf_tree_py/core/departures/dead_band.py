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

"""Holds back what hardly moves, so that interpolation brings it back; no clock of its own."""

from collections.abc import Iterable
from dataclasses import dataclass

from ..arrivals.sample import Sample
from ..geometry import se3


@dataclass(slots=True)
class _Frame:
    """
    What went of a frame, and what did not.

    :ivar sent: the last sample that went.
    :ivar turn: when the next one goes at the latest.
    :ivar held: the newest since then, which did not go.
    """

    sent: Sample
    turn: float
    held: Sample | None = None


class DeadBand:
    """
    Lets a sample of a frame through if the frame has moved since the last one that went.

    It has moved if it is further than ``min_move`` or ``min_turn`` from that one, or hangs on
    another parent. The sample before it, where that was held back, goes with it: otherwise
    a line between the two that went would tell of a slow motion where there was a rest. Every
    sample goes that comes when nothing went for ``max_silence``; one that still waits by then
    goes too. So the last pose of a frame always arrives. This is the boxcar of data
    historians: Hale, Sellars, "Historical data recording for process computers", Chemical
    Engineering Progress 77 (1981), with distances of poses in place of differences.

    While stamps go forward, and by ``se3.distance``:

    - the newest pose that went is within the thresholds of the newest that came;
    - at the stamp of any sample, what is interpolated between those that went is within twice
      the thresholds of it. Where something was held back between two that went, every pose
      held back, and every pose on the way between the two, is within the thresholds of
      the first. The triangle inequality gives the rest.

    While stamps go back, nothing is held back. It costs O(1) a sample, and memory for the
    frames of the last ``max_silence`` only.
    """

    def __init__(self, min_move: float, min_turn: float, max_silence: float) -> None:
        """
        Begin without samples.

        :param min_move: metres.
        :param min_turn: radians.
        :param max_silence: nanoseconds.
        """
        self._min_move = min_move
        self._min_turn = min_turn
        self._max_silence = max_silence
        # The earliest turn first: each is put at the end, as time only goes forward.
        self._frames: dict[str, _Frame] = {}

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None: nothing can be due."""
        return next((frame.turn for frame in self._frames.values()), None)

    def offer(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        """
        Take samples, and return those that go, of each frame in the order of their stamps.

        :param now: nanoseconds of a clock that never goes back.
        """
        return [went for sample in samples for went in self._offer(sample, now)]

    def due(self, now: int) -> list[Sample]:
        """Return those that were held back long enough."""
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
