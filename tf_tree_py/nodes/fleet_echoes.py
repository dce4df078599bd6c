# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recognises transforms that a robot sent to its fleet and that return on its own topics."""

from collections import OrderedDict
from collections.abc import Callable, Collection
import threading

from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.thinning import Send

# Samples that are remembered: sixteen seconds of 25 frames at 50 Hz.
_REMEMBERED = 20_000
# Two nodes may occasionally send the same sample; this many come from a loop.
_MANY = 200
# The tolerance for a pose that was sent in messages.
_SAME = 1e-9

_CURE = ('a relay of the fleet (--from-zenoh) publishes in the DDS domain of this robot. Run that '
         'relay in a separate domain (ROS_DOMAIN_ID)')


class FleetEchoes:
    """
    Drops samples that return, because they would circulate for ever, and warns once.

    A fleet's relay publishes samples with the robot's name in front, ``robot7/base``, and with
    the stamp of the original ``base``. All methods are thread-safe.
    """

    def __init__(self, robot: str, warn: Callable[[str], object]) -> None:
        """
        Start without sent samples.

        :param robot: its name in the fleet.
        """
        self._prefix, self._warn = f'{robot}/', warn
        self._lock = threading.Lock()
        self._sent: OrderedDict[tuple[str, int], PoseTuple] = OrderedDict()
        self._repeated = 0
        self._warned = False

    def remembering(self, send: Send) -> Send:
        """Return a function that sends a message, and remembers its samples."""
        def sending(samples: Collection[Sample]) -> None:
            self._remember(samples)
            send(samples)

        return sending

    def without(self, take: Callable[[list[Sample]], None]) -> Callable[[list[Sample]], None]:
        """Return a function that takes a message, and drops samples that return."""
        def taking(samples: list[Sample]) -> None:
            with self._lock:
                news = [sample for sample in samples if not self._is_echo(sample)]
            # A message without transforms is passed on, too.
            if news or not samples:
                take(news)

        return taking

    def _remember(self, samples: Collection[Sample]) -> None:
        with self._lock:
            for sample in samples:
                self._sent[sample.child, sample.stamp] = sample.pose
            while len(self._sent) > _REMEMBERED:
                self._sent.popitem(last=False)

    def _is_echo(self, sample: Sample) -> bool:
        if not sample.child.startswith(self._prefix):
            return False
        if (sample.child.removeprefix(self._prefix), sample.stamp) in self._sent:
            self._warn_once(f'{sample.child!r} comes back from the fleet: {_CURE}')
            return True
        # The robot itself may put its name in front.
        before = self._sent.get((sample.child, sample.stamp))
        if before is None or any(abs(old - new) > _SAME for old, new in zip(
                before, sample.pose, strict=True)):
            return False
        self._repeated += 1
        if self._repeated == _MANY:
            self._warn_once(f'{sample.child!r} and others come back repeatedly: perhaps '
                            f'{_CURE}')
        return True

    def _warn_once(self, sentence: str) -> None:
        if not self._warned:
            self._warned = True
            self._warn(sentence)
