# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The CPU cost of turning a robot's joint states into transforms."""

from collections.abc import Iterator
from contextlib import ExitStack

from .listening import start, Stream
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import OURS, PLAIN, Row

JOINTS, RATE_HZ = 40, 500
# Every message is sent as transforms, or 20 a second, the default.
FREQUENCIES = (1000.0, 20.0)

_OF_PLAIN = 1.0


def joints(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure urdf_broadcaster and a subscription with an empty callback, at the same time."""
    for frequency in FREQUENCIES:
        with ExitStack() as processes:
            publisher = processes.enter_context(start('joint_publisher'))
            ears = {way: processes.enter_context(start('joint_subscriber', way, str(frequency)))
                    for way in (OURS, PLAIN)}
            stream = Stream(publisher, ears, JOINTS, RATE_HZ)
            stream.await_all()
            rounds = [stream.play(effort.stream_s) for _ in range(effort.streams)]
        row = Row('joints', f'{JOINTS} x {RATE_HZ} Hz, sent at {min(frequency, RATE_HZ):g} Hz',
                  'us a message',
                  {way: [one.cpu_us[way] for one in rounds] for way in ears})
        row.compare(OURS, PLAIN, _OF_PLAIN)
        yield row
