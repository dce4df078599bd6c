"""
A robot and a desk, two hosts as far as the network can tell, and a link between them.

Each is a network namespace of its own; a pair of virtual Ethernet ports joins the two and
nothing else, so no traffic leaves this machine. It needs root.
"""

from contextlib import closing, ExitStack
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import textwrap
import time

import pytest
from ros_helpers import PATIENCE_S, until
from tf_tree_py import LATEST

GAP_S = 5.0
# With it all of this takes less than a second after the link, without it up to three.
PROFILES = Path(__file__).parents[2] / 'config' / 'fastdds_wireless.xml'

ROBOT = """
    import sys
    import threading

    import rclpy
    from tf_tree_py import Pose, StaticTransformBroadcaster, TransformBroadcaster
    from tf_tree_py.ros.messages.convert import transform_stamped

    rclpy.init()
    node = rclpy.create_node('robot')
    fixed, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
    at_the_end = threading.Event()

    def drive():
        while not at_the_end.wait(0.02):
            now = node.get_clock().now().nanoseconds
            moving.sendTransform(transform_stamped('map', 'base', now, Pose(x=1.0)))

    driving = threading.Thread(target=drive)
    driving.start()
    print('drives', flush=True)
    # Each line is the name of a sensor to mount; the end of the input is the end.
    for line in sys.stdin:
        fixed.sendTransform(transform_stamped('base', line.strip(), 0, Pose(x=2.0)))
        print('mounted', flush=True)
    at_the_end.set()
    driving.join()
    rclpy.shutdown()
"""

DESK = """
    import json
    import sys

    import rclpy
    from tf_tree_py import Buffer, TransformException, TransformListener

    rclpy.init()
    buffer = Buffer()
    with TransformListener(buffer):
        print('listens', flush=True)
        # Each line asks where a frame is at a stamp, and how long to wait for the answer.
        for line in sys.stdin:
            frame, stamp, timeout_s = json.loads(line)
            try:
                print(buffer.lookup_within(timeout_s, 'map', frame, stamp).x, flush=True)
            except TransformException as error:
                print(type(error).__name__, flush=True)
    rclpy.shutdown()
"""


def ip(*arguments):
    """Run the command; return what it prints."""
    return subprocess.run(['ip', *arguments], check=True, capture_output=True, text=True,
                          timeout=PATIENCE_S).stdout


class Host:
    """A network namespace, and the program that runs there: a line in, a line out."""

    def __init__(self, name):
        self.name = name
        self._process = None
        ip('netns', 'add', name)

    def run(self, program):
        """Start a program; return when it has printed its first line."""
        environment = {
            **os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(PROFILES),
            # The two hosts share their memory, and DDS must not talk through that.
            'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
        self._process = subprocess.Popen(
            ['ip', 'netns', 'exec', self.name, sys.executable, '-c', textwrap.dedent(program)],
            text=True, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout.readline()

    def tell(self, line):
        """Give the program a line; return what it answers."""
        print(line, file=self._process.stdin, flush=True)
        return self._process.stdout.readline().strip()

    def close(self):
        try:
            if self._process is not None:
                self._end()
        finally:
            ip('netns', 'delete', self.name)

    def _end(self):
        try:
            self._process.stdin.close()
            assert self._process.wait(PATIENCE_S) == 0
        finally:
            self._process.kill()
            self._process.stdout.close()


@pytest.fixture
def hosts():
    """Return two hosts, joined by a link."""
    if shutil.which('ip') is None:
        pytest.skip('two hosts need the command ip (of iproute2), which is not installed')
    with ExitStack() as stack:
        try:
            made = [stack.enter_context(closing(Host(f'tf_{os.getpid()}_{number}')))
                    for number in (1, 2)]
            ip('-n', made[0].name, 'link', 'add', 'link0', 'type', 'veth',
               'peer', 'link0', 'netns', made[1].name)
            for number, host in enumerate(made, start=1):
                ip('-n', host.name, 'address', 'add', f'10.0.0.{number}/24', 'dev', 'link0')
                for device in ('lo', 'link0'):
                    ip('-n', host.name, 'link', 'set', device, 'up')
        except subprocess.CalledProcessError as error:
            pytest.skip(f'two hosts need the right to make network namespaces: {error.stderr}')
        # DDS takes a port that is not up yet for one that never will be.
        for host in made:
            until(lambda host=host: 'state UP' in ip('-n', host.name, 'link', 'show', 'link0'))
        yield made


def test_after_a_gap_lookups_go_on_and_statics_that_were_missed_arrive(hosts):
    robot, desk = hosts
    robot.run(ROBOT)
    desk.run(DESK)

    def where_is(frame, stamp=None, timeout_s=PATIENCE_S):
        """Return what the desk knows of a frame; at this very moment unless told otherwise."""
        stamp = time.time_ns() if stamp is None else stamp
        return desk.tell(json.dumps([frame, stamp, timeout_s]))

    assert robot.tell('camera') == 'mounted'
    # The latest first, for nobody knows when the two find each other.
    assert where_is('camera', LATEST) == where_is('camera') == '3.0'
    ip('-n', robot.name, 'link', 'set', 'link0', 'down')
    assert robot.tell('lidar') == 'mounted'
    assert where_is('base', timeout_s=GAP_S) == 'FutureExtrapolationException'
    assert where_is('lidar', LATEST, 0.0) == 'LookupException'
    ip('-n', robot.name, 'link', 'set', 'link0', 'up')
    assert [where_is(frame) for frame in ('base', 'camera', 'lidar')] == ['1.0', '3.0', '3.0']
