# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sends varied garbage to programs at 1 kHz for ten seconds, and counts the lines that they print.

    python test/log_flood_trials.py                  # all of them
    python test/log_flood_trials.py anchor page      # some

It is no test, because it takes half a minute for each. The tests are in docs/symptoms.md.
"""

from collections import Counter
from contextlib import suppress
import json
import math
import socket
import subprocess
import sys
import threading
import time

from garbage import garbage

RATE_HZ, SENDING_S, AFTER_S, START_S = 1000, 10.0, 12.0, 3.0
PORT, ZENOH = 18455, 'tcp/127.0.0.1:17455'

LISTENS = """
import rclpy
from tf_tree_py import Buffer, TransformListener
rclpy.init()
node = rclpy.create_node('listens')
def wanted(parent, child):
    if {raises}:
        raise ValueError(f'cannot judge {{child[:40]}}')
    return True
listener = TransformListener(Buffer(node=node), node, frame_filter=wanted)
rclpy.spin(node)
"""
FLEET = f"""
import logging, threading, zenoh
from tf_tree_py.fleet import FleetListener
logging.basicConfig()
router = zenoh.open(zenoh.Config.from_json5('{json.dumps({
    'mode': 'router', 'listen': {'endpoints': [ZENOH]},
    'scouting': {'multicast': {'enabled': False}}})}'))
listener = FleetListener({ZENOH!r})
threading.Event().wait()
"""
ROBOT = ('<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
         '<parent link="a"/><child link="b"/></joint></robot>')


def node(name, *arguments):
    return '-m', f'tf_tree_py.nodes.{name}', *arguments


# --- what is sent, by its number

def transforms(number):
    return garbage(number, int(time.time()))


def poses(cls, frame):
    """Return a function that makes poses with five faults, or none."""
    def make(number):
        message = cls()
        turn, way = divmod(number, 6)
        message.header.frame_id = frame if way else f'wrong_{turn}'
        message.header.stamp.sec = int(time.time()) if way > 1 else -turn
        message.pose.pose.position.x = math.nan if way == 2 else 100.0 * turn
        message.pose.pose.orientation.w = float(way != 3)
        message.pose.covariance = [(1e-4 if way != 4 else -1.0) * (place % 7 == 0)
                                   for place in range(36)]
        return message

    return make


def joints(number):
    from sensor_msgs.msg import JointState
    turn, way = divmod(number, 3)
    return JointState(name=['j'] if way else [f'j{turn}'],
                      position=[math.nan if way == 1 else 0.0] * (1 + (way == 2) * turn))


def parameters(number):
    from rclpy.parameter import Parameter
    return [Parameter('frame_prefix', value=f'{number}/').to_parameter_msg()]


# --- who sends it

def at_1_khz(send):
    begin, number = time.monotonic(), 0
    while (passed := time.monotonic() - begin) < SENDING_S:
        while number < passed * RATE_HZ:
            send(number)
            number += 1
        time.sleep(0.001)
    return number


def over_dds(cls, topic, make):
    import rclpy
    from rclpy.serialization import serialize_message
    rclpy.init()
    publisher = rclpy.create_node('floods').create_publisher(cls, topic, 1000)
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    return at_1_khz(lambda number: publisher.publish(
        made if isinstance(made := make(number), bytes) else serialize_message(made)))


def by_service():
    from rcl_interfaces.srv import SetParameters
    import rclpy
    rclpy.init()
    client = rclpy.create_node('floods').create_client(
        SetParameters, 'urdf_broadcaster/set_parameters')
    client.wait_for_service()
    return at_1_khz(lambda number: client.call_async(
        SetParameters.Request(parameters=parameters(number))))


def over_zenoh():
    from tf_tree_py.fleet import configuration, open_session
    with open_session(configuration(ZENOH), 30.0) as session:
        return at_1_khz(lambda number: session.put(f'robot{number % 500}/tf', transforms(number)))


def over_tcp():
    def send(number):
        with suppress(OSError), socket.create_connection(('127.0.0.1', PORT), 2.0) as connection:
            connection.sendall(b'POST /%d HTTP/1.1\r\n\r\n' % number)

    return at_1_khz(send)


def trials():
    """Return the programs, each with the function that floods it."""
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState
    from tf2_msgs.msg import TFMessage
    described = node('urdf_broadcaster', '--ros-args', '-p', f'robot_description:={ROBOT}')
    return {
        'listener': (('-c', LISTENS.format(raises=False)),
                     lambda: over_dds(TFMessage, '/tf', transforms)),
        'callback': (('-c', LISTENS.format(raises=True)),
                     lambda: over_dds(TFMessage, '/tf', transforms)),
        'relay': (node('tf_relay', '--ros-args', '-r', '__ns:=/r1'),
                  lambda: over_dds(TFMessage, '/r1/tf', transforms)),
        'anchor': (node('relocalisation_anchor'), lambda: over_dds(
            PoseWithCovarianceStamped, '/pose', poses(PoseWithCovarianceStamped, 'map'))),
        'switch': (node('edge_switch'),
                   lambda: over_dds(Odometry, '/wheel/odom', poses(Odometry, 'odom'))),
        'joints': (described, lambda: over_dds(JointState, '/joint_states', joints)),
        'parameters': (described, by_service),
        'fleet': (('-c', FLEET), over_zenoh),
        'page': (('-m', 'tf_tree_py.view.tf_view', '--port', str(PORT)), over_tcp)}


def flood(name):
    """Flood one program from another process; print its lines in each second."""
    process = subprocess.Popen([sys.executable, '-u', *trials()[name][0]], text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    lines = []
    threading.Thread(target=lambda: lines.extend(
        (time.monotonic(), line) for line in process.stdout), daemon=True).start()
    time.sleep(START_S)
    begin, before = time.monotonic(), len(lines)
    sent = subprocess.run([sys.executable, __file__, '--send', name], stdout=subprocess.PIPE,
                          text=True, check=True).stdout
    time.sleep(AFTER_S)
    process.terminate()
    seconds = Counter(int(when - begin) for when, _ in lines[before:])
    print(f'{name}: {sent.strip()} sent, {seconds.total()} lines, '
          f'at most {max(seconds.values(), default=0)} in a second', flush=True)


if __name__ == '__main__':
    if sys.argv[1:2] == ['--send']:
        print(trials()[sys.argv[2]][1]())
        sys.stdout.flush()
    else:
        for each in sys.argv[1:] or trials():
            flood(each)
