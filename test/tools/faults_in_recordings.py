# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Put each fault of an edge into recordings, and print what the doctor finds, as a table.

    python test/tools/faults_in_recordings.py BAG PARENT CHILD [BAG PARENT CHILD ...]

Findings of the recording itself are left out.
"""

from argparse import Namespace
from pathlib import Path
import sys

for level in (2, 1):
    if (folder := str(Path(__file__).parents[level])) not in sys.path:
        sys.path.insert(0, folder)

from edge_faults import ERRORS, WARNINGS  # noqa: E402
import numpy as np  # noqa: E402
from robot_model import BEGIN, Edge, Robot, SECOND  # noqa: E402
from tf_tree_py.core.messages.observers import Observer  # noqa: E402
from tf_tree_py.health.measures.thresholds import Thresholds  # noqa: E402
from tf_tree_py.tools.tree_input import open_input  # noqa: E402

DAY = 86_400 * SECOND


class Kept(Observer):
    """The samples of a recording: (received, stamp, pose) by edge and kind."""

    def __init__(self):
        self.samples = {}

    def received(self, arrival):
        batch = arrival.batch
        for edge, stamp, pose in zip(batch.edges, batch.stamps, batch.poses, strict=True):
            self.samples.setdefault((*edge, arrival.static), []).append(
                (arrival.received, stamp, np.frombuffer(pose)))


class Recorded(Robot):
    """A robot of a recording."""

    def __init__(self, samples):
        self.rng, self.edges, self.authority = np.random.default_rng(0), {}, ''
        received, stamps = (np.array([each[column] for (_, _, static), columns in samples.items()
                                      for each in columns if not static]) for column in (0, 1))
        self.seconds = float(np.ptp(received)) / SECOND
        first = int(stamps.min()) // SECOND * SECOND
        # The arrivals of a simulation, or of another computer, go by a clock of their own.
        shared = abs(np.median(received - stamps)) < DAY
        self.first, begin = (BEGIN, first) if shared else (first // SECOND, int(received.min()))
        self.lead = (int(stamps.min()) - first) / SECOND
        for (parent, child, static), columns in samples.items():
            received, stamps, poses = zip(*columns, strict=True)
            self.edges[parent, child, static] = Edge(
                parent, child, (np.array(stamps) - (0 if static else first)) / SECOND,
                (np.array(received) - begin) / SECOND, np.array(poses), '', static)

    @property
    def origin(self):
        return self.first


def samples_of(bag):
    """Return the samples of a recording."""
    kept = Kept()
    arguments = Namespace(bag=Path(bag), tf_topic=None, tf_static_topic=None, ros_arguments=[],
                          fleet=None, fleet_config=None)
    with open_input(arguments, 'faults', [kept], cache_time=Thresholds().cache_time) as tree_input:
        tree_input.watch(None)
    return kept.samples


def codes(samples, parent, child, fault):
    """Return the codes and severities that a doctor finds after a fault."""
    robot = Recorded(samples)
    fault(robot, robot.edges[parent, child, False])
    return {(one.code, one.severity.value) for one in robot.findings()}


def cell(fault, samples, parent, child):
    """Return what the fault adds to the findings of a recording."""
    with np.errstate(all='ignore'):
        added = (codes(samples, parent, child, fault)
                 - codes(samples, parent, child, lambda robot, edge: None))
    return ', '.join(sorted({code if severity != 'note' else f'{code} (note)'
                             for code, severity in added})) or '–'


def main(arguments):
    """Print the table."""
    places = [(samples_of(bag), parent, child)
              for bag, parent, child in zip(*[iter(arguments)] * 3, strict=True)]
    for name, fault in [*ERRORS.items(), *WARNINGS.items()]:
        print('|', ' | '.join([f'`{name}`', *(cell(fault, *place) for place in places)]), '|')


if __name__ == '__main__':
    main(sys.argv[1:])
