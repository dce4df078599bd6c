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

"""What to export of a bag: between which frames, and at which stamps."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
import warnings

from tf_tree_py.bag import BagWarning, open_bag, Recording, stamps_of
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.trajectory import (
    Outside,
    stamps_at_rate,
    stamps_of_slowest,
    Trajectory,
    trajectory,
)

from .stamp_file import stamps_in
from ..arguments import add_number
from ..endings import Cannot


class Plan(NamedTuple):
    """
    What to export of each bag; it can be sent to another process.

    :ivar at: a topic, at the stamps of whose headers; or None.
    :ivar at_stamps: at these, nanoseconds; or None.
    :ivar rate_hz: at that rate; or None. With none of the three, at the stamps of the slowest
        edge between the frames.
    :ivar topics: of the transforms; None: all.
    """

    target_frame: str
    source_frame: str
    at: str | None
    at_stamps: Stamps | None
    rate_hz: float | None
    twist: bool
    outside: Outside
    topics: Sequence[str] | None

    def of(self, path: Path) -> tuple[Trajectory, Recording]:
        """
        Return what a bag has of it, and the bag as a buffer.

        :raises BagError: it cannot be read, or does not have the topic.
        :raises TransformException: the frames are not there, or have no answers.
        :raises Cannot: there is no stamp with a transform.
        """
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', BagWarning)  # the recording has it all
            recording = open_bag(path, topics=self.topics)
        frames = self.target_frame, self.source_frame
        taken = trajectory(recording, *frames, self._stamps(recording), twist=self.twist,
                           outside=self.outside)
        if taken.outside == len(taken.stamps) or not len(taken.stamps):
            raise Cannot(f'none of {taken.outside} stamps has a transform between {frames[0]!r} '
                         f'and {frames[1]!r}')
        return taken, recording

    def _stamps(self, recording: Recording) -> Stamps:
        if self.at_stamps is not None:
            return self.at_stamps
        if self.at is not None:
            return stamps_of(recording, self.at)
        frames = self.target_frame, self.source_frame
        if self.rate_hz is not None:
            return stamps_at_rate(recording, *frames, self.rate_hz)
        return stamps_of_slowest(recording, *frames)


def add_frames(parser: Any) -> None:
    """Add the arguments that name the two frames."""
    parser.add_argument('target', metavar='TARGET', help='in which frame')
    parser.add_argument('source', metavar='SOURCE', help='where which frame was')


def add_plan(parser: Any) -> None:
    """Add the arguments for what ``planned`` makes of them."""
    stamps = parser.add_argument_group(
        'at which stamps', 'those of the slowest edge between the frames, unless given'
    ).add_mutually_exclusive_group()
    stamps.add_argument('--at', metavar='TOPIC', help='those in the headers of a topic')
    stamps.add_argument('--at-file', metavar='CSV', type=Path, help='those in the first column '
                        'of a file: integer nanoseconds, or seconds with a point')
    add_number(stamps, '--rate', None, 'that many a second')
    parser.add_argument('--outside', choices=['skip', 'nan', 'fail'], default='skip',
                        help='stamps without a transform: left out (unless given), NaN, or an '
                        'error')
    parser.add_argument('--twist', action='store_true', help="velocities, too, of the source's "
                        "origin, in the target's axes")
    parser.add_argument('--topic', metavar='TOPIC', action='append', dest='topics',
                        help='read transforms of this topic only; may be given again')


def planned(arguments: Namespace) -> Plan:
    """
    Return what the arguments of ``add_frames`` and ``add_plan`` say.

    :raises Cannot: there are no stamps in the file.
    """
    at_stamps = None if arguments.at_file is None else stamps_in(arguments.at_file)
    return Plan(arguments.target, arguments.source, arguments.at, at_stamps, arguments.rate,
                arguments.twist, arguments.outside, arguments.topics)
