# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One fault of one edge for each code of the doctor that concerns an edge.

Each is a function of a robot, with ``edges``, ``seconds`` and ``rng``, and of the edge. A fault
may be put on an edge that has another one.
"""

import numpy as np
from robot_model import Edge, keep, NEVER, planar


def middle(robot):
    """Return when most faults begin, seconds since the start."""
    return robot.seconds / 3.0


def beside(robot, parent, child, times, *, static=False, x=0.0):
    """Add messages with one more edge, at these times."""
    times = np.asarray(times, float)
    robot.edges[len(robot.edges)] = Edge(
        parent, child, times + robot.lead, times + 0.003,
        planar(x + (0.0 if static else 0.1) * np.sin(times), 0.0 * times, 0.0 * times), 'another',
        static)


def merge(edge, stamps, poses, delay=0.004):
    """Add samples of another publisher to an edge."""
    _merge(edge, stamps, stamps + delay, poses)


def _merge(edge, stamps, received, poses):
    received = np.concatenate([edge.received, received])
    order = np.argsort(received, kind='stable')
    edge.stamps = np.concatenate([edge.stamps, stamps])[order]
    edge.poses, edge.received = np.concatenate([edge.poses, poses])[order], received[order]


def restamp(edge, stamps):
    """Change the stamps, except those that are zero."""
    edge.stamps = np.where(edge.stamps > NEVER, stamps, edge.stamps)


def not_finite(robot, edge):
    edge.poses[min(100, len(edge.poses) // 3), 0] = np.nan


def no_rotation(robot, edge):
    edge.poses[min(200, len(edge.poses) // 2), 3:] = 0.0


def unreadable(robot, edge):
    beside(robot, edge.parent, 2000 * 'm', [5.0])


def zero_stamps(robot, edge):
    edge.stamps[1::20] = NEVER


def clock_mixture(robot, edge):
    restamp(edge, edge.stamps + 1e6)


def one_in_the_far_future(robot, edge):
    edge.stamps[min(300, len(edge.stamps) // 3)] += 3600.0


def stale(robot, edge):
    keep(edge, edge.received < middle(robot))


def frozen_stamp(robot, edge):
    later = edge.received > 0.5 * middle(robot)
    restamp(edge, np.where(later, edge.stamps[later & (edge.stamps > NEVER)][0], edge.stamps))


def loop(robot, edge):
    beside(robot, edge.child, edge.parent, np.arange(5.0, 6.0, 0.1))


def two_parents(robot, edge):
    beside(robot, 'another', edge.child, np.arange(0.0, robot.seconds, 0.02))


def two_publishers(robot, edge):
    """Add another publisher, 4 ms later and 0.2 m beside the first."""
    other = edge.poses.copy()
    other[:, 0] += 0.2
    _merge(edge, edge.stamps + 0.004, edge.received + 0.004, other)


def kind_flips(robot, edge):
    beside(robot, edge.parent, edge.child, [5.0], static=True)


ERRORS = {
    'not_finite': not_finite, 'not_normalised': no_rotation, 'unreadable': unreadable,
    'zero_stamps': zero_stamps, 'clock_mixture': clock_mixture,
    'future_stamps': one_in_the_far_future, 'stale': stale, 'frozen_stamp': frozen_stamp,
    'loop': loop, 'two_parents': two_parents, 'two_publishers': two_publishers,
    'kind_flips': kind_flips}


def delayed(robot, edge):
    edge.received = edge.received + 0.7 + 0.1 * np.sin(edge.received)


def static_republished(robot, edge):
    edge.poses[:] = edge.poses[-1]


def static_changed(robot, edge):
    beside(robot, edge.parent, edge.child, [5.0], static=True)
    beside(robot, edge.parent, edge.child, [6.0], static=True, x=0.3)


def static_late(robot, edge):
    beside(robot, edge.parent, edge.child, [0.8 * middle(robot)], static=True)


def moved_once(robot, edge):
    edge.poses[:] = edge.poses[-1]
    edge.poses[edge.received > middle(robot), 0] += 0.03


def interpolated_jump(robot, edge):
    keep(edge, np.arange(len(edge.stamps)) % 10 == 0)
    edge.poses[edge.received > middle(robot), 0] += 0.6


def not_normalised(robot, edge):
    edge.poses[:, 3:] *= 1.1


def shifted(seconds):
    def shift(robot, edge):
        restamp(edge, edge.stamps + seconds)
    return shift


def clock_step(robot, edge):
    restamp(edge, edge.stamps + 0.7 * (edge.stamps > middle(robot)))


def clock_drift(robot, edge):
    restamp(edge, 0.98 * edge.stamps)


def whole_seconds(robot, edge):
    restamp(edge, np.floor(edge.stamps))


def jump_back(robot, edge):
    restamp(edge, edge.stamps - 8.0 * (edge.stamps > 1.2 * middle(robot)))


def duplicate_stamps(robot, edge):
    restamp(edge, edge.stamps[np.arange(len(edge.stamps)) // 2 * 2])


def out_of_order(robot, edge):
    late = (np.diff(edge.stamps, prepend=0.0) > 0.0) & (np.arange(len(edge.stamps)) % 10 == 5)
    restamp(edge, edge.stamps - 2.5 * np.median(np.diff(edge.stamps)) * late)


def lone_stamp(robot, edge):
    edge.stamps[min(100, len(edge.stamps) // 3)] -= 3600.0


def gap(robot, edge):
    keep(edge, (edge.received < 0.4 * middle(robot)) | (edge.received > 0.75 * middle(robot)))


def irregular_rate(robot, edge):
    keep(edge, np.isin(np.arange(len(edge.stamps)) % 20, [0, 1, 2, 9]))


def slow(robot, edge):
    keep(edge, np.arange(len(edge.stamps)) % 100 == 0)


def pose_jump(robot, edge):
    edge.poses[edge.received > middle(robot), 0] += 20.0


def outlier(robot, edge):
    edge.poses[59::60, 0] += 5.0


def too_fast(robot, edge):
    edge.poses[:, 0] += 400.0 * edge.stamps


WARNINGS = {
    'delayed': delayed, 'static_republished': static_republished,
    'static_changed': static_changed, 'static_late': static_late,
    'moved_once': moved_once, 'interpolated_jump': interpolated_jump,
    'not_normalised': not_normalised, 'clock_offset': shifted(-0.5),
    'future_stamps': shifted(0.4), 'post_dated': shifted(0.2), 'clock_step': clock_step,
    'clock_drift': clock_drift, 'whole_seconds': whole_seconds, 'lone_stamp': lone_stamp,
    'jump_back': jump_back, 'duplicate_stamps': duplicate_stamps, 'out_of_order': out_of_order,
    'gap': gap, 'irregular_rate': irregular_rate, 'skew': slow, 'pose_jump': pose_jump,
    'outlier': outlier, 'too_fast': too_fast}
