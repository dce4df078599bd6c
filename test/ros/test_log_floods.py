# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A flood of varied garbage over DDS: a line a second for each kind, and all counts."""

import time

from garbage import flows_of, garbage, omitted, told
from hand_clock import clock_of_logs
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from ros_helpers import transform, until
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, FlightRecorder, GyroListener, Pose
from tf_tree_py.recording.flight_recorder import Happened

SENT, AT_ONCE = 3000, 50


def test_flood_of_varied_transforms(node, listen, talker, log):
    buffer = listen(node)
    talker.move(transform('map', 'before'), into=buffer)
    until(lambda: {edge.authority for edge in buffer.edges()} == {'/talking'})
    before = buffer.statistics()
    assert not log()
    now, begin = int(time.time()), time.monotonic()

    def arrived():
        """Return how many messages were inserted or refused; a remark is about an inserted one."""
        return buffer.statistics().accepted + buffer.statistics().refused

    for number in range(SENT):
        talker.send(garbage(number, now))
        if number % AT_ONCE == AT_ONCE - 1:
            # The middleware keeps a thousand messages.
            until(lambda number=number: arrived() == before.accepted + number + 1)
    counts = {kind.value: count for kind, count in buffer.statistics().incidents.items() if count}
    assert sum(counts.values()) > SENT * 0.8 and len(counts) >= 8
    # The flood has ended, and its last counts are logged without another message.
    until(lambda: told(log().splitlines()) == sum(counts.values()))
    elapsed_s = time.monotonic() - begin
    flows = flows_of(log().splitlines())
    assert {kind for kind, _ in flows} == counts.keys()
    # The node's publishers may be without a name for a moment.
    assert ('NaN or infinity', '/talking') in flows and len({sender for _, sender in flows}) <= 2
    for flow, lines in flows.items():
        assert len(lines) <= elapsed_s + 1.0, flow
    for kind, count in counts.items():
        assert sum(told(flows[flow]) for flow in flows if flow[0] == kind) == count


def test_publishers_with_a_profile_that_does_not_match(
        node, listen, make_node, log, use_wait_set, monkeypatch):
    """Rclpy would log a line for each, and anyone can make them at any rate."""
    clock = clock_of_logs(monkeypatch)
    buffer, careless = listen(node), make_node('careless')

    def publish_carelessly():
        careless.create_publisher(
            TFMessage, '/tf', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))

    publish_carelessly()
    until(lambda: 'RELIABILITY' in log())
    for count in range(1, 5):
        publish_carelessly()
        until(lambda count=count: omitted(buffer.feeds.log) == count)
    assert log().count('incompatible QoS') == 1
    clock.now += 1.0
    until(lambda: "4 more like this from '/tf': incompatible QoS" in log())
    assert len(log().splitlines()) == 2


def test_gyroscope(node, make_node, log, monkeypatch):
    clock = clock_of_logs(monkeypatch)
    buffer = Buffer()
    buffer.insert('odom', 'base', 1, Pose())
    with GyroListener(buffer, node, 'base', 'imu', qos=1000) as listener:
        publisher = make_node('broken').create_publisher(Imu, 'imu', 1000)
        until(publisher.get_subscription_count)
        for number in range(300):
            message = Imu()
            message.header.frame_id = f'imu_{number}'
            publisher.publish(serialize_message(message))
        until(lambda: omitted(listener._topics.log) == 299)
        assert log().count('cannot be used') == 1 and '[asking]' in log()
        clock.now += 1.0
        until(lambda: "299 more like this from '/imu': unusable angular velocity, LookupException"
              in log())


def test_recordings_that_are_not_written(log, monkeypatch):
    clock_of_logs(monkeypatch)
    recorder = FlightRecorder()
    Buffer(flight_recorder=recorder)
    for number in range(1000):
        recorder.notify(Happened('lookup_failed', f'frame {number}'), None, f'too soon {number}')
    assert log().count('not recorded') == 1
