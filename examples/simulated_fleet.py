# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A simulated fleet: each robot drives a circle, and publishes over Zenoh, without ROS.

python examples/simulated_fleet.py 20       then: tf_view --fleet tcp/127.0.0.1:7447
"""

import argparse
import math
import signal
import threading

from tf_tree_py.core import Pose, Sample
from tf_tree_py.fleet.robot_publisher import drive, SimulatedRobot
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion
import zenoh

SPACING_M = 6.0
RATE_HZ = 10.0


def robot(number: int, columns: int) -> SimulatedRobot:
    """Return a robot of five frames, including the map, which drives in a circle."""
    motion = FiveFrameMotion(lap_time=(15 + number) * 1_000_000_000)
    row, column = divmod(number, columns)
    map_T_world = Pose(x=SPACING_M * column, y=SPACING_M * row)

    def moving(stamp: int) -> list[Sample]:
        return [Sample('map', 'odom', stamp, map_T_world @ motion.world_T_odom(stamp)),
                Sample('odom', 'base_link', stamp, motion.odom_T_base_link(stamp)),
                Sample('base_link', 'gripper', stamp, motion.base_link_T_gripper(stamp))]

    camera = Sample('base_link', 'camera', 0, motion.base_link_T_camera)
    return SimulatedRobot(f'robot{number + 1}', [camera], moving)


def main() -> None:
    """Drive until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('robots', nargs='?', type=int, default=20, help='how many')
    parser.add_argument('--listen', default='tcp/127.0.0.1:7447', help='the address of its router')
    arguments = parser.parse_args()
    if arguments.robots < 1:
        parser.error('a fleet must have at least one robot')
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    columns = math.isqrt(max(0, arguments.robots - 1)) + 1
    robots = [robot(number, columns) for number in range(arguments.robots)]
    # This session is the router, so no other program is required.
    config = zenoh.Config.from_json5(f"""{{
        mode: 'router', listen: {{endpoints: ['{arguments.listen}']}},
        scouting: {{multicast: {{enabled: false}}}}, timestamping: {{enabled: true}}}}""")
    with zenoh.open(config) as session:
        print(f'{len(robots)} robots are driving: tf_view --fleet {arguments.listen}', flush=True)
        drive(session, robots, RATE_HZ, ended)


if __name__ == '__main__':
    main()
