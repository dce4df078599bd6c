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

"""
A fleet without robots: each drives its circle, and says so over Zenoh. No ROS.

python examples/simulated_fleet.py 20       then: tf_view --fleet tcp/127.0.0.1:7447
"""

import argparse
import math
import signal
import threading

from tf_tree_py.core import Pose, Sample
from tf_tree_py.fleet.simulated import drive, SimulatedRobot
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion
import zenoh

SPACING_M = 6.0
RATE_HZ = 10.0


def robot(number: int, columns: int) -> SimulatedRobot:
    """Return a robot of five frames, the map among them, with a circle of its own."""
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
    parser.add_argument('--listen', default='tcp/127.0.0.1:7447', help='where its router answers')
    arguments = parser.parse_args()
    if arguments.robots < 1:
        parser.error('a fleet has at least one robot')
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    columns = math.isqrt(max(0, arguments.robots - 1)) + 1
    robots = [robot(number, columns) for number in range(arguments.robots)]
    # This session is the router, so nothing else has to run.
    config = zenoh.Config.from_json5(f"""{{
        mode: 'router', listen: {{endpoints: ['{arguments.listen}']}},
        scouting: {{multicast: {{enabled: false}}}}, timestamping: {{enabled: true}}}}""")
    with zenoh.open(config) as session:
        print(f'{len(robots)} robots are driving: tf_view --fleet {arguments.listen}', flush=True)
        drive(session, robots, RATE_HZ, ended)


if __name__ == '__main__':
    main()
