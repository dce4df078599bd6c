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

"""Late poses in the map as a map -> odom that never jumps."""

from collections.abc import Sequence
from functools import partial
import sys
import threading
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core.anchor import Anchor, GATE, Sighting
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.covariances import checked_covariance
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import time_message
from tf_tree_py.ros.messages.uncertain import uncertain_values
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .blended_edge import frame_of, LIMITS, limits_of
from .edge_messages import samples_of
from .outlets import Outlet
from .parameters import declare, describe, Setting
from .running import Parser, run, spin

NAME = 'relocalisation_anchor'

_DESCRIPTION = """\
Publishes map -> odom, out of poses in the map that come late: of AMCL, of a tag, of anything
that publishes PoseWithCovarianceStamped on the topic pose. Each is held against the
odometry of its own stamp, gated by both covariances, and fused with what is held; what is
published goes over to it without a jump, no faster than max_speed and max_turn_rate. Nothing
is published before two poses agree. Ctrl-C ends."""

SETTINGS = (
    Setting('map_frame', 'map', 'the frame of the poses, and the parent of what is published'),
    Setting('odom_frame', 'odom', 'the child of what is published'),
    Setting('frame', 'base_link', 'whose poses they are: the camera or the robot'),
    Setting('rate_hz', 30.0, 'how often to publish', (0.1, 1000.0)),
    Setting('ahead', 0.05, 'by how much the stamps that are published are ahead, seconds, so '
            'that whoever looks up in between has the next one', (0.0, 10.0)),
    *LIMITS,
    Setting('gate', GATE, 'the squared Mahalanobis distance beyond which a pose is refused',
            (0.0, 1e9)),
    Setting('drift', 0.05, 'how the odometry gets lost, metres for the root of a second',
            (0.0, 1e6)),
    Setting('turn_drift', 0.02, 'likewise, radians', (0.0, 1e6)),
    Setting('wait', 0.5, 'how long a pose waits for the odometry of its stamp, seconds',
            (0.0, 3600.0)),
)


class RelocalisationAnchor(Node):
    """
    Publishes map -> odom; see ``Anchor``.

    Transforms are heard by a thread of its own; poses and the timer are served by whoever
    spins the node.
    """

    def __init__(self, name: str = NAME, **node_options: Any) -> None:
        """
        Begin to listen.

        :param name: the node's.
        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter is wrong.
        """
        super().__init__(name, **node_options)
        values = self._values = declare(self, SETTINGS)
        self._map, self._odom, self._frame = (
            frame_of(values, key) for key in ('map_frame', 'odom_frame', 'frame'))
        self._ahead = from_seconds(values['ahead'])
        self._anchor = Anchor(
            limits_of(values), (values['drift'], values['turn_drift']), values['gate'])
        # Futures end in the thread that hears transforms.
        self._lock = threading.Lock()
        self._buffer = Buffer(node=self)
        self._listener = TransformListener(self._buffer, self)
        self._tf = Outlet(self, TF_TOPIC, dynamic_qos())
        self._last = 0
        self._awaited: set[Any] = set()
        self.create_subscription(PoseWithCovarianceStamped, 'pose', self._hear, 10)
        self.create_timer(1.0 / values['rate_hz'], self.publish)

    def _hear(self, message: PoseWithCovarianceStamped) -> None:
        """Wait for the odometry of a pose's stamp."""
        try:
            sample, = samples_of(message, self._map, self._frame)
            covariance = checked_covariance(message.pose.covariance)
        except TransformException as error:
            self._warn(f'A pose is of no use: {error}')
            return
        known = self._buffer.wait_for_transform_async(
            self._odom, self._frame, message.header.stamp, Duration(seconds=self._values['wait']))
        self._awaited.add(known)
        known.add_done_callback(partial(self._take, sample.stamp, sample.pose, covariance))

    def _take(self, stamp: int, pose: PoseTuple, covariance: Array, known: Any) -> None:
        """Take a pose whose odometry is there, or never comes."""
        self._awaited.discard(known)
        if known.cancelled():
            return
        try:
            if known.exception() is not None:
                raise known.exception()
            there = self._buffer.lookup_uncertain(
                self._odom, self._frame, time_message(stamp))
            odom_T_frame, spread = uncertain_values(there.pose)
            with self._lock:
                verdict = self._anchor.take(Sighting(
                    stamp, pose, covariance, odom_T_frame, spread))
        except TransformException as error:
            self._warn(f'A pose is of no use: {error}')
            return
        if verdict.accepted:
            return
        why = ('nothing confirms it yet' if verdict.distance is None else
               f'its squared Mahalanobis distance is {verdict.distance:.0f}, and the gate '
               f'{self._values["gate"]:g}')
        self._warn(f'The pose of {format_stamp(stamp)} was refused: {why}')

    def publish(self) -> None:
        """Publish map -> odom, if it is known; never twice for one stamp."""
        stamp = self.get_clock().now().nanoseconds + self._ahead
        with self._lock:
            if stamp < self._last:  # the clock has jumped back: another run
                self.get_logger().warning(
                    f'The clock went back by {format_span(self._last - stamp)}: begin anew')
                self._anchor.begin_anew()
            if stamp == self._last:
                return
            self._last = stamp
            pose: Pose | None = self._anchor.publish(stamp)
        if pose is not None:
            self._tf.send([Sample(self._map, self._odom, stamp, pose)])

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=5.0)

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._listener.close()
        for known in list(self._awaited):
            known.cancel()
        super().destroy_node()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: spin(RelocalisationAnchor(), ended))


if __name__ == '__main__':
    sys.exit(main())
