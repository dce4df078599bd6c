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

"""What the joint states of a robot cost: CPU of a process that makes transforms of them."""

from collections.abc import Iterator
from contextlib import ExitStack

from .listening import start, Stream
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import OURS, PLAIN, Row

JOINTS, RATE_HZ = 40, 500
# Every message goes out as transforms, or 20 a second, as by default.
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
