# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One drive of the robot with tf_tree_py, as the node ``relocalisation_anchor`` uses it.

The tree is map -> odom -> base -> camera. Odometry and map -> odom are inserted at 50 Hz, and a
reader looks up the robot at each of their stamps.
"""

from collections import deque
from functools import lru_cache
from itertools import pairwise
import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from tf_tree_py import (
    Anchor,
    BlendLimits,
    BufferCore,
    from_seconds,
    Pose,
    Sighting,
    TransformException,
    UNLIMITED,
)
from tf_tree_py.beyond.corrections.anchor import Verdict

from .localiser import Burst, Seen, sightings
from .robot import (
    Array,
    driven,
    FINE_HZ,
    IN_PLANE,
    Motion,
    motion_of,
    ODOMETRY_HZ,
    one,
    Robot,
    Wheels,
)

# The defaults of the node.
LIMITS = BlendLimits(from_seconds(0.3), 0.2, 0.1, 0.0)
AHEAD = from_seconds(0.05)

PERIOD = 1_000_000_000 // ODOMETRY_HZ
_FINE = 1_000_000_000 // FINE_HZ
# A reader's second question is between two samples.
_BETWEEN = 7_300_000
# For how many samples before a judged stamp map -> odom has a covariance.
_WITH_COVARIANCE = 10
_CERTAIN = np.zeros((6, 6))

# The camera on the robot: where it should be, and the standard deviations of where it is.
_BASE_T_CAMERA = one((0.3, 0.1, 0.9), (0.0, 0.4, 0.0))
_MOUNTED = np.array([0.005] * 3 + [0.01] * 3)


class Story(NamedTuple):
    """
    What happens in a drive, seconds.

    :ivar judged: when the covariances are compared with the errors.
    :ivar carried_at: when the robot is carried to another place.
    :ivar bursts: when outliers begin to agree, and which share of the sightings they are.
    :ivar jump_above: metres and radians, see ``Anchor``.
    """

    seconds: float
    judged: tuple[float, ...] = ()
    outage: tuple[float, float] = (0.0, 0.0)
    carried_at: float | None = None
    bursts: tuple[tuple[float, float], ...] = ()
    jump_above: tuple[float, float] = (math.inf, math.inf)


DRIVE = Story(88.0, (19.0, 39.9, 60.0, 87.0), outage=(20.0, 40.0), carried_at=64.0)
AGREEING = Story(50.0, bursts=((12.0, 0.5), (28.0, 1.0)))
JUMPING = Story(28.0, carried_at=10.0, jump_above=(1.0, 0.5))
_TOGETHER_S = (2.0, 5.0)


class Setting(NamedTuple):
    """
    Where a robot drives, and the drift that the anchor assumes.

    :ivar drift: of the odometry, metres and radians per square root of a metre.
    """

    planar: bool
    rate_hz: float
    wheels: Wheels
    drift: tuple[float, float]


class Judged(NamedTuple):
    """
    The normalised estimation errors squared, per degree of freedom.

    :ivar estimate: of ``Anchor.held``, at its own stamp.
    :ivar lookup: of ``lookup_uncertain('map', 'camera')``, now.
    """

    estimate: float
    lookup: float


class Record(NamedTuple):
    """
    A drive; N are the stamps of the odometry.

    :ivar truth: N poses of map_T_base.
    :ivar odometry: N poses of odom_T_base.
    :ivar published: (N, 7) of map_T_odom; NaN before the first.
    :ivar read: (N, 7) of map_T_base as a reader gets it.
    :ivar estimated: (N, 7) of map_T_base by the anchor's estimate.
    :ivar verdicts: on each delivery.
    :ivar answers: how many lookups were repeated at the end, and how many differed.
    """

    bursts: tuple[Burst, ...]
    truth: Motion
    odometry: Motion
    published: Array
    read: Array
    estimated: Array
    verdicts: list[tuple[Seen, Verdict]]
    judged: list[Judged]
    answers: tuple[int, int]


@lru_cache(maxsize=2)
def _robot(planar: bool, wheels: Wheels, story: Story, seed: int) -> tuple[Robot, Motion]:
    """Return a robot that is the same at all rates of the localiser, and its camera's mounting."""
    rng = np.random.default_rng((seed, planar, round(story.seconds)))
    robot = driven(rng, story.seconds, planar, wheels, story.carried_at)
    error = _MOUNTED * rng.normal(size=6)
    return robot, Motion(_BASE_T_CAMERA.positions + error[:3],
                         Rotation.from_rotvec(error[3:]) * _BASE_T_CAMERA.rotations)


def drive(setting: Setting, story: Story, seed: int) -> Record:
    """Let one robot drive."""
    planar, rate_hz = setting.planar, setting.rate_hz
    robot, camera = _robot(planar, setting.wheels, story, seed)
    rng = np.random.default_rng((seed, planar, round(story.seconds), round(rate_hz)))
    bursts = tuple(Burst(begin, begin + round(rng.uniform(*_TOGETHER_S), 1), share)
                   for begin, share in story.bursts)
    coming = sightings(rng, robot.fine, rate_hz, planar, story.outage, bursts)
    tree, verdicts, judged = _Tree(setting, story), [], []
    instants = {from_seconds(when) for when in story.judged}
    uncertain = {instant - back * PERIOD for instant in instants
                 for back in range(_WITH_COVARIANCE)}
    published, read, estimated = np.full((3, len(robot.truth.positions), 7), np.nan)
    due = deque(coming)
    for number, row in enumerate(robot.odometry.rows().tolist()):
        now = number * PERIOD
        tree.hear_odometry(now, Pose._make(row))
        while due and due[0].arrival <= now:
            seen = due.popleft()
            verdicts.append((seen, tree.hear(seen)))
        if tree.anchor.held is None:
            continue
        published[number], estimated[number] = tree.publish(now, now in uncertain)
        read[number] = tree.read(now)
        if now in instants:
            held_at = robot.fine[tree.anchor.held.stamp // _FINE]
            judged.append(tree.judged(now, held_at, camera.after(robot.truth[number])))
    return Record(bursts, robot.truth, robot.odometry, published, read, estimated, verdicts,
                  judged, tree.asked_again())


class _Tree:
    """The buffer, the anchor that publishes map -> odom, and a reader."""

    def __init__(self, setting: Setting, story: Story) -> None:
        self._seen = np.flatnonzero(IN_PLANE) if setting.planar else np.arange(6)
        self._drift = np.diag(np.square([setting.drift[0]] * 3 + [setting.drift[1]] * 3))
        if setting.planar:
            self._drift *= IN_PLANE
        self.anchor = Anchor(LIMITS, (0.0, 0.0), drift_by_way=setting.drift,
                             planar=setting.planar, jump_above=story.jump_above)
        self._buffer = BufferCore(UNLIMITED)
        self._buffer.insert('base', 'camera', 0, _BASE_T_CAMERA.rows(), static=True,
                            covariance=np.diag(_MOUNTED**2))
        self._odometry: list[Pose] = []
        self._answers: dict[tuple[str, int], Pose] = {}
        self._uncertain: dict[int, tuple[Pose, Array]] = {}

    def hear_odometry(self, stamp: int, odom_T_base: Pose) -> None:
        """Take a sample of the odometry."""
        self._buffer.insert('odom', 'base', stamp, odom_T_base)
        self._odometry.append(odom_T_base)

    def hear(self, seen: Seen) -> Verdict:
        """Take a sighting, whose odometry has arrived."""
        odom_T_base = self._buffer.lookup('odom', 'base', seen.stamp)
        return self.anchor.update(Sighting(
            seen.stamp, Pose._make(seen.pose), seen.covariance, odom_T_base, _CERTAIN))

    def publish(self, now: int, uncertain: bool) -> tuple[Pose, Pose]:
        """Publish map -> odom; return it, and the robot's pose by the anchor's estimate."""
        map_T_odom, held = self.anchor.publish(now + AHEAD, self._odometry[-1]), self.anchor.held
        assert map_T_odom is not None and held is not None
        self._buffer.insert('map', 'odom', now + AHEAD, map_T_odom,
                            covariance=self._covariance(map_T_odom) if uncertain else None)
        return map_T_odom, Pose._make(held.map_T_odom) @ self._odometry[-1]

    def _covariance(self, map_T_odom: Pose) -> Array:
        """
        Return the covariance of the published map_T_odom.

        It is that of the estimate, with the drift since then and while the sample is ahead, and
        with what remains of a blend.
        """
        held = self.anchor.held
        assert held is not None
        here = motion_of(map_T_odom @ self._odometry[-1])
        there = motion_of(Pose._make(held.map_T_odom) @ self._odometry[-1])
        since, lead = held.stamp // PERIOD, AHEAD // PERIOD
        whole = moved(there.positions - held.place, held.covariance)
        # A turn of the odometry also moves the robot by its lever from where it turned.
        for before, after in pairwise([*self._odometry[since:], self._odometry[-1 - lead]]):
            step = self._drift * math.dist(before[:3], after[:3])
            place = Pose._make(held.map_T_odom) @ before[:3]
            whole += moved(there.positions - place, step)
        left = off(here, there)
        return moved(np.subtract(map_T_odom[:3], here.positions), whole + np.outer(left, left))

    def read(self, now: int) -> Pose | tuple[float, ...]:
        """Ask for the robot now, and for the camera between two samples."""
        try:
            self._ask('camera', now - _BETWEEN)
            return self._ask('base', now)
        except TransformException:  # map -> odom begins later
            return (np.nan,) * 7

    def _ask(self, frame: str, stamp: int) -> Pose:
        self._answers[frame, stamp] = answer = self._buffer.lookup('map', frame, stamp)
        return answer

    def judged(self, now: int, held_at: Motion, camera: Motion) -> Judged:
        """
        Compare covariances with errors.

        :param held_at: the true pose of the robot at the estimate's stamp.
        :param camera: the true pose of the camera now.
        """
        held = self.anchor.held
        assert held is not None
        odom_T_base = self._buffer.lookup('odom', 'base', held.stamp)
        estimated = motion_of(Pose._make(held.map_T_odom) @ odom_T_base)
        covariance = moved(estimated.positions - held.place, held.covariance)
        found = self._uncertain[now] = self._buffer.lookup_uncertain('map', 'camera', now)
        return Judged(squared(off(estimated, held_at)[self._seen],
                              covariance[np.ix_(self._seen, self._seen)]),
                      squared(off(motion_of(found[0]), camera), found[1]))

    def asked_again(self) -> tuple[int, int]:
        """Repeat all questions; return how many there are, and how many answers differ."""
        differ = sum(self._buffer.lookup('map', frame, stamp) != answer
                     for (frame, stamp), answer in self._answers.items())
        for now, (pose, covariance) in self._uncertain.items():
            again = self._buffer.lookup_uncertain('map', 'camera', now)
            differ += again[0] != pose or not np.array_equal(again[1], covariance)
        return len(self._answers) + len(self._uncertain), differ


# --- covariances, in the convention of ROS's PoseWithCovariance

def off(pose: Motion, other: Motion) -> Array:
    """Return (..., 6) how far another pose is off: a shift and a rotation, in fixed axes."""
    turn = other.rotations * pose.rotations.inv()
    return np.concatenate([other.positions - pose.positions, turn.as_rotvec()], axis=-1)


def moved(lever: Array, covariance: Array) -> Array:
    """Return the covariance of a point that is a lever away on the same rigid body."""
    x, y, z = lever
    matrix = np.eye(6)
    matrix[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return np.asarray(matrix @ covariance @ matrix.T)


def squared(error: Array, covariance: Array) -> float:
    """Return the normalised error squared, per degree of freedom."""
    return float(error @ np.linalg.solve(covariance, error)) / len(error)
