# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The documented argument types, for type checkers, which must also find the mistakes."""

from datetime import datetime, timezone
from typing import assert_type

import numpy as np
import numpy.typing as npt
from tf_tree_py import BufferCore, lookup_twist, Pose, Poses, Spline, UNLIMITED
from tf_tree_py.beyond.motion.trajectory import MovingTrajectory, Trajectory, trajectory


class Rotation:
    """Like scipy's, which has no type annotations."""

    def as_quat(self, canonical: bool = False) -> npt.NDArray[np.float64]:
        return np.array([0.0, 0.0, 0.0, 1.0])


def stamps(buffer: BufferCore, times: npt.NDArray[np.int64]) -> None:
    """Stamps are integers of Python and numpy, and times that include their unit."""
    assert_type(buffer.lookup('map', 'base', 1_000_000_000), Pose)
    for time in times:
        buffer.lookup('map', 'base', time)
    buffer.lookup('map', 'base', np.int64(1))
    buffer.lookup_at('map', 'base', np.uint64(1))
    buffer.lookup('map', 'base', np.datetime64('2026-01-01T00:00:00', 'ns'))
    buffer.lookup_uncertain('map', 'base', datetime.now(timezone.utc))
    buffer.lookup_full('map', times[0], 'base', datetime.now(timezone.utc), 'odom')
    lookup_twist(buffer, 'base', 'map', times[0], 100_000_000)
    assert_type(buffer.lookup_many('map', 'base', times), Poses)
    buffer.lookup_many('map', 'base', [1, 2, 3])
    buffer.lookup_many('map', 'base', times.astype('datetime64[ns]'))
    buffer.lookup_many('map', 'base', [datetime.now(timezone.utc)])


def ages(buffer: BufferCore, limit: np.int64) -> None:
    """Limits are integers of Python and numpy."""
    for max_age in (None, 500_000_000, UNLIMITED, limit):
        assert_type(buffer.lookup('map', 'base', max_age=max_age), Pose)
        assert_type(buffer.lookup_within(0.1, 'map', 'base', max_age=max_age), Pose)
        assert_type(buffer.lookup_tree('map', max_age=max_age), dict[str, Pose])
    newest = buffer.lookup_newest('map', 'base', max_age=limit)
    assert_type(newest.pose, Pose)
    assert_type(newest.stamps, dict[str, int])
    assert_type(newest.oldest, int)


def poses(buffer: BufferCore, times: npt.NDArray[np.int64]) -> None:
    """Poses are all supported representations."""
    buffer.insert('map', 'base', times[0], Pose(x=1.0))
    buffer.insert('map', 'base', 1, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    buffer.insert('map', 'base', 1, np.eye(4))
    buffer.insert('map', 'base', 1, Rotation())
    buffer.insert_from('wheels', 'odom', 'base', np.int64(1), np.eye(4))
    buffer.correct('odom', np.eye(4), stamp=times[0])
    buffer.insert_track('map', 'base', times, np.zeros((2, 7)))
    buffer.insert_track('map', 'base', times, [Pose(), Pose(x=1.0)])
    buffer.insert_track('map', 'base', times, [np.eye(4), np.eye(4)])
    buffer.insert_track('map', 'base', times, [Rotation(), Rotation()])
    buffer.insert_curve('map', 'base', Spline.fit(times, np.zeros((9, 4, 4)), 10.0))


def velocities(buffer: BufferCore, times: npt.NDArray[np.int64], twist: bool) -> None:
    """With ``twist=True`` there are velocities; with an unknown value, a caller must check."""
    taken = trajectory(buffer, 'map', 'base', times, twist=True)
    assert_type(taken, MovingTrajectory)
    assert_type(taken.twists, npt.NDArray[np.float64])
    perhaps = trajectory(buffer, 'map', 'base', times, twist=twist)
    assert_type(perhaps, Trajectory)
    perhaps.twists[0]  # type: ignore[index]


def mistakes(buffer: BufferCore) -> None:
    """Every mistake is found; a comment without an error to ignore is itself an error."""
    buffer.lookup('map', 'base', 1.5)  # type: ignore[arg-type]
    buffer.lookup('map', 'base', '1')  # type: ignore[arg-type]
    buffer.insert('map', 'base', 1.5, Pose())  # type: ignore[arg-type]
    buffer.insert('map', 'base', 1, BufferCore())  # type: ignore[arg-type]
    buffer.lookup_many('map', 'base', BufferCore())  # type: ignore[call-overload]
