# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Healthy robots with every ugliness that a correct system may have.

Stamps are late, quantised or tremble; messages come in bursts or twice; edges are fast, slow, at
rest or spinning; a simulation or a recorder pauses, and the recorder begins late.
"""

from dataclasses import dataclass, field

from hypothesis import strategies as st
import numpy as np
from robot_model import BEGIN, Edge, planar, Robot, SECOND
from tf_tree_py.health.doctor import Doctor


@dataclass(frozen=True)
class Habits:
    """
    How one edge is sent.

    :ivar late: how long after the measurement it is stamped at most, as a part of the period.
    :ivar jitter: of the measurements, as a part of the period.
    :ivar step: of its stamps, seconds; 0: they are exact; -1: seconds since the start of its
        computer, as a float32.
    :ivar uptime: of that computer, seconds.
    :ivar burst: how many messages arrive together.
    :ivar twice: the part of the messages that arrive twice.
    """

    rate_hz: float = 50.0
    motion: str = 'drive'
    late: float = 0.0
    jitter: float = 0.0
    step: float = 0.0
    uptime: float = 1000.0
    burst: int = 1
    twice: float = 0.0


@dataclass
class UglyRobot(Robot):
    """
    A healthy robot.

    :ivar habits: by the names of the edges that move.
    :ivar pause: when everything pauses, as a part of the time, and for how many seconds.
    :ivar recorder: when the recorder begins, as a part of the time.
    :ivar resent: how often a static edge is sent again, as float32.
    """

    habits: dict[str, Habits] = field(default_factory=dict)
    pause: tuple[float, float] | None = None
    recorder: float = 0.0
    resent: int = 0

    def __post_init__(self):
        self.rng = np.random.default_rng(self.seed)
        for name, habits in self.habits.items():
            self._send(*EDGES[name], habits)
        self._send_static()
        if self.pause:
            self._pause()

    def _send(self, parent, child, sender, habits):
        period = 1.0 / habits.rate_hz
        measured = np.arange(0.0, self.seconds, period)
        measured = measured + habits.jitter * period * self.rng.uniform(-0.5, 0.5, len(measured))
        poses = MOTIONS[habits.motion](self, measured, habits)
        stamps = self._quantised(
            measured + habits.late * period * self.rng.uniform(0.0, 1.0, len(measured)), habits)
        sent = stamps[np.minimum(np.arange(len(stamps)) // habits.burst * habits.burst
                                 + habits.burst - 1, len(stamps) - 1)]
        received = np.maximum.accumulate(
            np.maximum(sent, measured) / self.pace
            + self.delay * self.rng.uniform(0.1, 1.0, len(measured)))
        tolerance = self.tolerance if sender == 'amcl' else 0.0
        again = np.sort(np.concatenate([np.arange(len(stamps)), np.flatnonzero(
            self.rng.random(len(stamps)) < habits.twice)]))
        self.edges[child] = Edge(parent, child, (stamps + tolerance)[again], received[again],
                                 poses[again], sender)

    def _quantised(self, times, habits):
        if habits.step < 0.0:
            return (habits.uptime + times).astype(np.float32).astype(float) - habits.uptime
        return np.floor(times / habits.step) * habits.step if habits.step else times

    def _send_static(self):
        for number, (name, x) in enumerate([('lidar', 0.123456789), ('camera', 471.123456789)]):
            times = np.linspace(0.0, self.seconds, 1 + self.resent, endpoint=False)
            poses = planar(np.full(len(times), x), 0.0 * times, np.full(len(times), 0.1))
            poses[1::2] = poses[1::2].astype(np.float32)
            received = np.minimum(times + number, self.seconds) / self.pace - 0.2
            self.edges[name] = Edge('base', name, times, received, poses, 'urdf', static=True)

    def _pause(self):
        """Let the simulation, or a recorder, pause."""
        part, seconds = self.pause
        begin, seconds = part * self.seconds, min(seconds, 0.2 * self.seconds)
        for edge in self.edges.values():
            if edge.static:
                continue
            if self.simulated:
                edge.received = edge.received + seconds * (edge.received > begin / self.pace)
            else:
                kept = (edge.received < begin) | (edge.received > begin + seconds)
                edge.stamps, edge.received, edge.poses = (
                    edge.stamps[kept], edge.received[kept], edge.poses[kept])

    def findings(self, doctor=None):
        """Return a doctor's findings; only of a recording is a pause no fault."""
        return super().findings(doctor or Doctor(recorded=self.pause is not None))

    def messages(self):
        """Return the messages between the begin and the end of the recording."""
        messages = super().messages()
        begin = BEGIN * SECOND + round(self.recorder * self.seconds / self.pace * SECOND)
        # The last message of the edge that ends first: the recorder does not stop later.
        end = min(max(message.received for message in messages if message.batch.edges == [frames])
                  for frames in {(edge.parent, edge.child) for edge in self.edges.values()
                                 if not edge.static})
        return [message for message in messages if message.received <= end
                and (message.static or message.received >= begin)]


EDGES = {
    'localiser': ('map', 'odom', 'amcl'), 'wheels': ('odom', 'base', 'wheels'),
    'arm': ('base', 'arm', 'arm'), 'wheel': ('base', 'wheel', 'wheels')}


def _spin(robot, t, habits):
    angle = robot.speed / 0.5 * t
    poses = np.zeros((len(t), 7))
    poses[:, 1], poses[:, 4], poses[:, 6] = 0.2, np.sin(angle / 2.0), np.cos(angle / 2.0)
    return poses


def _noise(robot, t, habits):
    return planar(*(min(0.01, 1.0 / habits.rate_hz) * robot.rng.normal(size=(3, len(t)))))


def _flicker(robot, t, habits):
    """Rest, but for the last digit of an encoder."""
    return planar(0.0 * t, 0.0 * t, 0.001 * (robot.rng.random(len(t)) > 0.5))


def _vibrate(robot, t, habits):
    """Vibrate near half the rate of the samples, by the uptime's last digit, with up to 40 g."""
    near = 2.0 * np.pi * (0.42 + 0.01 * (habits.uptime % 10)) * habits.rate_hz
    return planar(0.3 * t, min(0.02, 400.0 / near**2) * np.sin(near * t), 0.0 * t)


def _stop_and_go(robot, t, habits):
    """Drive for two seconds, and stand for two."""
    return planar(robot.speed * (2.0 * (t // 4.0) + np.minimum(t % 4.0, 2.0)), 0.0 * t, 0.0 * t)


MOTIONS = {
    'drive': lambda robot, t, habits: robot.drive(t),
    'straight': lambda robot, t, habits: planar(robot.speed * t, 0.0 * t, 0.0 * t),
    'swing': lambda robot, t, habits: robot.swing(t),
    'correct': lambda robot, t, habits: robot.corrections(t),
    'stand': lambda robot, t, habits: planar(1.0 + 0.0 * t, 0.0 * t, 0.0 * t),
    'turn': lambda robot, t, habits: planar(0.2 * np.sin(20.0 * t), 0.2 * np.cos(20.0 * t),
                                            20.0 * t),
    'spin': _spin, 'flicker': _flicker, 'noise': _noise, 'vibrate': _vibrate,
    'stop and go': _stop_and_go}


def _habits(motions, most_hz=1000.0):
    """Return a strategy of habits; steps of stamps are not longer than the period."""
    rates = st.sampled_from([1.0, 2.0, 5.0, 7.5, 10.0, 20.0, 50.0, 125.0, 200.0, 500.0, 1000.0])
    return rates.filter(lambda rate: rate <= most_hz).flatmap(lambda rate: st.builds(
        lambda motion, irregular, *more: Habits(rate, motion, *irregular, *more),
        st.sampled_from(motions),
        # Together they are shorter than the period: samples of one publisher are in order.
        st.sampled_from([(0.0, 0.0), (0.3, 0.1), (0.6, 0.4), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5)]),
        st.sampled_from([step for step in (0.0, 0.001, 0.01, 0.1, -1.0) if step * rate <= 1.0]),
        st.sampled_from([uptime for uptime in (10.0, 1003.0, 20_005.0)
                         if np.spacing(np.float32(uptime)) * rate <= 1.0]),
        st.sampled_from([burst for burst in (1, 1, 2, 5, 20) if burst <= 1 + 0.3 * rate]),
        st.sampled_from([0.0, 0.0, 0.005, 0.05])))


HABITS = st.fixed_dictionaries({
    'localiser': _habits(['correct', 'stand'], 50.0),
    'wheels': _habits(['drive', 'straight', 'stand', 'noise', 'vibrate', 'stop and go', 'turn']),
    'arm': _habits(['swing', 'flicker', 'turn']), 'wheel': _habits(['spin'])})

HEALTHY_ROBOTS = st.booleans().flatmap(lambda simulated: st.builds(
    UglyRobot, seed=st.integers(0, 2**32), habits=HABITS,
    pace=st.sampled_from([0.05, 0.3, 1.0, 2.0, 5.0] if simulated else [1.0]),
    simulated=st.just(simulated), seconds=st.floats(8.0, 20.0),
    delay=st.sampled_from([0.001, 0.01, 0.05]), tolerance=st.sampled_from([0.0, 0.0, 0.2, 1.0]),
    speed=st.sampled_from([0.3, 1.0, 2.0, 10.0]),
    pause=st.none() | st.tuples(st.floats(0.3, 0.5), st.floats(0.5, 5.0)),
    recorder=st.sampled_from([0.0, 0.0, 0.3]), resent=st.integers(0, 4)))
