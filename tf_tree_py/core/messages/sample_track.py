# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Many samples of one edge, checked all at once.

The result equals that of inserting them one by one: the same samples are refused, for the
same reasons. Samples that cannot be checked together are inserted one by one.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .incidents import Incident
from .sample import checked, judged_poses, Sample
from ..edges.protocol import MovingHistory
from ..errors import InvalidArgumentException
from ..geometry.poses import checked_poses
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, format_span
from ..times import Stamps


class SampleTrack(NamedTuple):
    """
    Samples of one edge in the order in which they arrive.

    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (N, 7) ``parent_T_child``.
    """

    parent: str
    child: str
    stamps: Stamps
    poses: Array

    @property
    def span(self) -> int:
        """Return the time between the earliest and the latest stamp, nanoseconds."""
        return int(self.stamps.max()) - int(self.stamps.min()) if len(self.stamps) else 0

    def gone(self, window: int) -> str:
        """Return a sentence saying that a window is too short for the track."""
        return (f'Samples of {self.parent!r} -> {self.child!r} span {format_span(self.span)}, and '
                f'the buffer keeps {format_span(window)}: older samples were dropped. '
                'cache_time=UNLIMITED keeps everything')

    def sample(self, number: int) -> Sample:
        """Return one sample by its number."""
        x, y, z, qx, qy, qz, qw = self.poses[number].tolist()
        return Sample(self.parent, self.child, int(self.stamps[number]),
                      (x, y, z, qx, qy, qz, qw))

    def samples(self, begin: int = 0) -> list[Sample]:
        """Return the samples from a number on."""
        return [self.sample(number) for number in range(begin, len(self.stamps))]

    def earliest_after(self) -> Stamps:
        """Return the earliest stamp of each sample and all after it, (N,)."""
        return np.minimum.accumulate(self.stamps[::-1])[::-1]

    def judged(self, authority: str) -> 'JudgedTrack':
        """Return the track with unit quaternions, and the incidents of refused samples."""
        poses, good = judged_poses(self.poses)
        refused = {}
        for number in np.flatnonzero(~good).tolist():
            sample = checked(self.sample(number), authority)
            if isinstance(sample, Incident):
                refused[number] = sample
            else:  # its quaternion was very small or large, and could be normalised
                poses[number], good[number] = sample.pose, True
        return JudgedTrack(self._replace(poses=poses), good, refused)

    def is_within(self, history: MovingHistory) -> bool:
        """Return whether no sample is older than the history's window when it is inserted."""
        window, latest = history.cache_time, history.latest_stamp
        assert latest is not None
        if not len(self.stamps):
            return True
        newest = max(latest, int(self.stamps.max()))
        if newest - int(self.stamps.min()) <= window:
            return True
        if window >= FOREVER:
            return False  # one by one: the difference overflows 64 bits
        before = np.maximum.accumulate(np.concatenate([[latest], self.stamps[:-1]]))
        return bool((self.stamps >= np.maximum(before, BEGINNING + window) - window).all())


class JudgedTrack(NamedTuple):
    """
    A track whose poses were checked.

    :ivar good: (N,) whether each sample can be taken.
    :ivar refused: the incidents of the others, by the sample's number.
    """

    track: SampleTrack
    good: npt.NDArray[np.bool_]
    refused: dict[int, Incident]

    def after(self, number: int) -> tuple[SampleTrack, list[Incident]]:
        """Return the good samples from a number on, and the incidents of the others there."""
        track, good = self.track, self.good[number:]
        stamps, poses = track.stamps[number:], track.poses[number:]
        if self.refused:
            stamps, poses = stamps[good], poses[good]
        return (track._replace(stamps=stamps, poses=poses),
                [incident for index, incident in self.refused.items() if index >= number])


def checked_track(parent: str, child: str, stamps: Stamps, poses: Any) -> SampleTrack:
    """
    Return a caller's samples.

    :raises InvalidArgumentException: names that are not strings, or mismatched shapes.
    """
    for name, frame in (('parent', parent), ('child', child)):
        if not isinstance(frame, str):
            raise InvalidArgumentException(f'{name} is the name of a frame, not {frame!r}')
    array = checked_poses(poses) if len(stamps) or np.size(poses) else np.empty((0, 7))
    if len(array) != len(stamps):
        raise InvalidArgumentException(
            f'there must be one pose (N, 7) for each stamp (N,): not {len(stamps)} stamps and '
            f'{len(array)} poses')
    return SampleTrack(parent.removeprefix('/'), child.removeprefix('/'), stamps, array)
