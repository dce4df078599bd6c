# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publishes a map -> odom that never jumps, from late poses in the map."""

from functools import partial
import math
import sys
import threading
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.task import Future
from tf_tree_py.beyond.corrections.anchor import Anchor, Remaining, Sighting, Verdict
from tf_tree_py.beyond.uncertainty.covariances import checked_covariance
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import time_message
from tf_tree_py.ros.messages.pose_covariances import uncertain_values
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.topics.qos import dynamic_qos, mismatches, TF_TOPIC
from tf_tree_py.ros.waiting.clock import JUMP_BACK

from .anchor_status import AnchorStatus, way_to_go
from .edge_messages import frame_of, LIMITS, limits_of, samples_of
from .parameters import declare, Setting
from .robot_topics import RawPublisher
from .running import ClosingNode, main_of

NAME = 'relocalisation_anchor'

_DESCRIPTION = """\
Publishes map -> odom from poses in the map that arrive late: from AMCL, from a tag detector,
or from any publisher of PoseWithCovarianceStamped on the topic pose. Each pose is compared
with the odometry of its own stamp, gated by both covariances, and fused with the current
estimate. The published transform blends to the new estimate without a jump, no faster than
max_speed and max_turn_rate. Until the blend ends, it differs from the estimate, which takes
long if the robot was carried away: /diagnostics has how far it still is, and with jump_above it
jumps instead. Nothing is published until two poses agree. Press Ctrl-C to stop."""
_EXAMPLES = (
    ('relocalisation_anchor --ros-args -r pose:=/amcl_pose', 'from the poses of AMCL'),
    ('relocalisation_anchor --ros-args -r pose:=/tag_pose -p frame:=camera',
     'from a tag that the camera sees'),
)

SETTINGS = (
    Setting('map_frame', 'map', 'the frame of the poses, and the parent of what is published'),
    Setting('odom_frame', 'odom', 'the child of what is published'),
    Setting('frame', 'base_link', 'the frame whose poses arrive: the camera or the robot'),
    Setting('rate_hz', 30.0, 'how often to publish, Hz', (0.1, 1000.0)),
    Setting('ahead', 0.05, 'how far ahead of the clock to stamp transforms, seconds, so that '
            'lookups between two of them succeed', (0.0, 10.0)),
    *LIMITS,
    Setting('jump_above', 0.0, 'the distance from the estimate beyond which the published '
            'transform jumps to it, metres; 0: it never jumps', (0.0, 1e9)),
    Setting('jump_turn_above', 0.0, 'the same for rotations, radians', (0.0, 1e9)),
    Setting('gate', 0.0, 'the squared Mahalanobis distance beyond which a pose is refused; 0: '
            'the one that refuses one good pose in a thousand', (0.0, 1e9)),
    Setting('drift', 0.05, 'the drift of the odometry, metres per square root of a second',
            (0.0, 1e6)),
    Setting('turn_drift', 0.02, 'likewise, radians', (0.0, 1e6)),
    Setting('way_drift', 0.0, 'the same by distance, metres per square root of a metre between '
            'two poses', (0.0, 1e6)),
    Setting('way_turn_drift', 0.0, 'the same for rotations, radians per square root of a metre',
            (0.0, 1e6)),
    Setting('planar', False, 'fuse x, y and yaw only; z, roll and pitch come from the odometry'),
    Setting('wait', 0.5, 'how long a pose waits for the odometry of its stamp, seconds',
            (0.0, 3600.0)),
)


class RelocalisationAnchor(ClosingNode):
    """
    Publishes map -> odom; see ``Anchor``.

    An internal thread receives transforms. The callbacks of poses and of the timer run in the
    thread that spins the node.
    """

    def __init__(self, name: str = NAME, **node_options: Any) -> None:
        """
        Start to receive and to publish.

        :param name: of the node.
        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid.
        """
        super().__init__(name, **node_options)
        values = self._values = declare(self, SETTINGS)
        self._map, self._odom, self._frame = (
            frame_of(values, key) for key in ('map_frame', 'odom_frame', 'frame'))
        self._ahead = from_seconds(values['ahead'])
        self._anchor = Anchor(
            limits_of(values), (values['drift'], values['turn_drift']), values['gate'] or None,
            drift_by_way=(values['way_drift'], values['way_turn_drift']),
            planar=values['planar'],
            jump_above=(values['jump_above'] or math.inf, values['jump_turn_above'] or math.inf))
        self._status = AnchorStatus(self, f'{self._map} -> {self._odom}')
        # Futures complete in the thread that receives transforms.
        self._lock = threading.Lock()
        self._buffer = Buffer(node=self)
        # The thread of the listener writes its counts.
        self._log = self._buffer.feeds.log
        self._awaited: set[Future] = set()
        self._closing.callback(self._give_up)
        self._closing.callback(TransformListener(self._buffer, self).close)
        self._tf = RawPublisher(self, TF_TOPIC, dynamic_qos())
        self._last = 0
        self._topic = self.resolve_topic_name('pose')
        self.create_subscription(PoseWithCovarianceStamped, 'pose', self._hear, 10,
                                 event_callbacks=mismatches(self._topic, self._log))
        self.create_timer(1.0 / values['rate_hz'], self.publish)
        self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _hear(self, message: PoseWithCovarianceStamped) -> None:
        """Wait for the odometry of a pose's stamp."""
        try:
            sample, = samples_of(message, self._map, self._frame)
            covariance = checked_covariance(message.pose.covariance)
        except TransformException as error:
            self._warn_of(error)
            return
        known = self._buffer.wait_for_transform_async(
            self._odom, self._frame, message.header.stamp, Duration(seconds=self._values['wait']))
        self._awaited.add(known)
        known.add_done_callback(partial(self._update, sample.stamp, sample.pose, covariance))

    def _update(self, stamp: int, pose: PoseTuple, covariance: Array, known: Future) -> None:
        """Update by a pose whose odometry has arrived, or will not arrive."""
        self._awaited.discard(known)
        if known.cancelled():
            return
        try:
            if known.exception() is not None:
                raise known.exception()
            there = self._buffer.lookup_uncertain(self._odom, self._frame, time_message(stamp))
            odom_T_frame, spread = uncertain_values(there.pose)
            with self._lock:
                verdict = self._anchor.update(Sighting(
                    stamp, pose, covariance, odom_T_frame, spread))
                left = self._anchor.remaining
                self._status.count(verdict)
        except TransformException as error:
            self._warn_of(error)
            return
        if verdict.accepted:
            self._log_large_change(stamp, verdict, left)
            return
        kind, why = (
            ('repeated pose', 'it was received before') if verdict.repeated else
            ('unconfirmed pose', 'no other pose confirms it yet') if verdict.distance is None else
            ('pose beyond the gate', f'its squared Mahalanobis distance is '
             f'{verdict.distance:.0f}, and the gate {self._anchor.gate:g}'))
        self._warn(kind, f'The pose of {format_stamp(stamp)} was refused: {why}')

    def _log_large_change(self, stamp: int, verdict: Verdict, left: Remaining) -> None:
        edge = f'{self._map} -> {self._odom}'
        if verdict.jump is not None:
            distance, angle = verdict.jump
            self._warn('jump', (
                f'{edge} jumps by {distance:.3g} m and {angle:.3g} rad to the estimate of '
                f'{format_stamp(stamp)}, because that is more than jump_above or jump_turn_above'),
                None)
        elif verdict.relocalised:
            self._warn('relocalisation', (
                f'Several poses up to {format_stamp(stamp)} agree on another estimate: {edge} is '
                f'{way_to_go(left)} from it, and blends to it'), None)

    def publish(self) -> None:
        """Publish map -> odom, if it is known; always with a later stamp than the last one."""
        stamp = self.get_clock().now().nanoseconds + self._ahead
        odom_T_frame = self._newest_pose()
        with self._lock:
            back = self._last - stamp
            if back >= JUMP_BACK:  # another run
                self._log.write('clock', '/clock', (
                    f'The clock went back by {format_span(back)}: starting again'))
                self._anchor.begin_anew()
            elif back >= 0:
                return
            self._last = stamp
            pose: Pose | None = self._anchor.publish(stamp, odom_T_frame)
        if pose is not None:
            self._tf.send([Sample(self._map, self._odom, stamp, pose)])

    def _newest_pose(self) -> Pose | None:
        """Return the newest pose of the frame in odom, if it is known."""
        try:
            return self._buffer.lookup(self._odom, self._frame)
        except TransformException:
            return None

    def _report(self) -> None:
        with self._lock:
            self._status.publish(self._anchor.held, self._anchor.remaining)

    def _warn_of(self, error: TransformException) -> None:
        self._warn(f'unusable pose, {type(error).__name__}', f'A pose cannot be used: {error}',
                   str(error))

    def _warn(self, kind: str, text: str, about: str | None = '') -> None:
        self._log.write(kind, self._topic, text, about)

    def _give_up(self) -> None:
        for known in list(self._awaited):
            known.cancel()


main = main_of(NAME, _DESCRIPTION, _EXAMPLES, SETTINGS, RelocalisationAnchor)


if __name__ == '__main__':
    sys.exit(main())
