# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_doctor: its statuses, its output, its JSON, on bags and over DDS."""

import json
import os
import subprocess
import sys
import threading

from bags import write_ros2
from patients import FAULTY, HEALTHY
from programs import completed, PATIENCE_S, Program
import pytest
from tool_helpers import documented

COMMAND = (sys.executable, '-m', 'tf_tree_py.tools.tf_doctor')


def doctor(*arguments, **options):
    return completed(*COMMAND, *arguments, **options)


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a healthy bag, one with an error, and one with a warning."""
    folder = tmp_path_factory.mktemp('bags')
    return {name: write_ros2(folder / name, sorted(messages, key=lambda each: each.received))
            for name, messages in (('well', HEALTHY['warehouse_robot']()),
                                   ('error', FAULTY['two_parents']),
                                   ('warning', FAULTY['gap']))}


# --- on bags

@pytest.mark.parametrize('name, strict, status', [
    ('well', True, 0), ('warning', False, 0), ('warning', True, 1), ('error', False, 1)])
def test_status_says_what_was_found_and_json_has_the_documented_shape(bags, name, strict, status):
    done = doctor('--bag', bags[name], '--json', *(['--strict'] if strict else []))
    assert (done.returncode, done.stderr) == (status, '')
    report = json.loads(done.stdout)
    of_report = documented('doctor', '### The report')
    of_finding = documented('doctor', '### A finding')
    assert report.keys() == of_report.keys()
    assert all(isinstance(report[key], cls) for key, cls in of_report.items())
    assert report['version'] == 1
    assert len(report['findings']) == sum(report[key] for key in ('errors', 'warnings', 'notes'))
    for finding in report['findings']:
        assert finding.keys() == of_finding.keys()
        assert all(isinstance(finding[key], cls) for key, cls in of_finding.items())
        assert finding['severity'] in ('error', 'warning', 'note')
        assert finding['evidence'] and finding['cause'] and finding['fix']


def test_finding_is_told_with_cause_and_fix_as_wide_as_the_terminal(bags):
    done = doctor('--bag', bags['error'], env={**os.environ, 'COLUMNS': '80'})
    assert max(map(len, done.stdout.splitlines())) <= 80
    told = ' '.join(done.stdout.split())
    assert told.startswith('error two_parents odom, map, base_link')
    assert 'base_link has the parents odom, map, and changed between them' in told
    assert 'cause two nodes publish the frame' in told
    assert 'fix decide which node publishes the frame' in told
    assert told.endswith('1 error')


@pytest.mark.parametrize('bag, arguments, sentence', [
    ('nowhere.mcap', [], 'there is no such file'),
    # Two clones have the same names of tests.
    pytest.param(__file__, [], 'is not a bag', id='another file'),
    ('well', ['--tf-topic', '/robot1/tf'], 'has no topic /robot1/tf; it has: '),
    ('well', ['--seconds', 'nan'], "'nan' is not a number greater than zero")])
def test_what_cannot_be_watched_is_one_sentence(bags, bag, arguments, sentence):
    done = doctor('--bag', bags.get(bag, bag), *arguments)
    assert (done.returncode, done.stdout) == (2, '')
    line, = done.stderr.splitlines()
    assert line.startswith('tf_doctor: ') and sentence in line


def test_reader_that_leaves_gets_no_complaint():
    with subprocess.Popen([*COMMAND, '--list'], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ''
    assert process.returncode == 0


# Makes packages appear not installed to the program.
HIDDEN = """
import sys
sys.modules.update(dict.fromkeys(sys.argv.pop(1).split(',')))
from tf_tree_py.tools.tf_doctor import main
sys.exit(main())
"""


@pytest.mark.parametrize('missing, arguments, sentence', [
    ('rich,rich.console', ['--list'], 'pip install rich'),
    ('rosbags,rosbags.interfaces', ['--bag', 'well'], 'reading and writing bags needs rosbags'),
    ('rclpy', [], 'a live tree needs ROS 2, and rclpy is not installed')])
def test_what_is_not_installed_is_one_sentence(bags, missing, arguments, sentence):
    arguments = [bags.get(each, each) for each in arguments]
    done = completed(sys.executable, '-c', HIDDEN, missing, *arguments)
    assert (done.returncode, done.stdout) == (2, '')
    line, = done.stderr.splitlines()
    assert line.startswith('tf_doctor: ') and sentence in line


# --- over DDS

rclpy = pytest.importorskip('rclpy')


class Beat:
    """Calls a function fifty times a second, until the end of the block; counts the calls."""

    def __init__(self, act):
        self.count = 0
        self._end = threading.Event()
        self._act = act
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        while not self._end.wait(0.02):
            self._act()
            self.count += 1

    def __enter__(self):
        self._thread.start()
        return self

    def wait_for(self, more):
        """Return after this number of further calls."""
        end = self.count + more
        while self.count < end:
            self._end.wait(0.01)

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()


def publisher(context, name, parent, child, x, topic='/tf', qos=None):
    """Return a node and a function that publishes an edge at the present time."""
    from rclpy.node import Node
    from tf2_msgs.msg import TFMessage
    from tf_tree_py.core import Pose
    from tf_tree_py.ros.messages.convert import transform_stamped
    from tf_tree_py.ros.topics.qos import dynamic_qos
    node = Node(name, context=context)
    sender = node.create_publisher(TFMessage, topic, qos or dynamic_qos())

    def send():
        now = node.get_clock().now().nanoseconds
        sender.publish(TFMessage(transforms=[transform_stamped(
            parent, child, now, Pose(x + 0.05 * (now / 1e9 % 10.0)))]))

    return node, send


def test_ctrl_c_tells_what_was_found_by_then_with_the_names_of_nodes(context):
    """On other topics than /tf and /tf_static, one given and one remapped."""
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    best_effort = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    tf, tf_static = '/robot1/tf', '/robot1/tf_static'
    nodes, sends = zip(
        publisher(context, 'wheels', 'odom', 'base', 0.0, tf),
        publisher(context, 'visual', 'odom', 'base', 1.0, tf),
        publisher(context, 'calibration', 'base', 'lidar', 0.3, tf_static, QoSProfile(depth=1)),
        publisher(context, 'driver', 'base', 'arm', 0.0, tf, best_effort), strict=True)
    # On a busy machine everything comes late, which is true, but no fault of these nodes.
    program = Program(*COMMAND, '--seconds', '1000', '--json', '--max-delay', str(PATIENCE_S),
                      '--tf-topic', 'robot1/tf', '--ros-args', '-r', f'/tf_static:={tf_static}')
    try:
        with Beat(lambda: [send() for send in sends]) as beat:
            while not nodes[0].count_subscribers(tf):
                beat.wait_for(1)
            beat.wait_for(100)
            program.interrupt()
            assert program.end() == 1
    finally:
        program.kill()
        for node in nodes:
            node.destroy_node()
    report = json.loads(program.output[program.output.index('{'):])
    assert report['interrupted'] is True and report['watched_s'] > 0.0
    found = {finding['code']: finding for finding in report['findings']}
    # A busy machine lets the nodes pause, and what a paused node sends has a gap.
    assert found.keys() - {'gap'} == {'two_publishers', 'late_joiner', 'qos_mismatch'}
    assert found['two_publishers']['frames'] == ['odom', 'base']
    assert {'/wheels', '/visual'} <= {*found['two_publishers']['publishers']}
    assert found['late_joiner']['publishers'] == ['/calibration']
    assert found['qos_mismatch']['publishers'][0] == '/driver'


@pytest.mark.parametrize('arguments, sentence', [
    (['--seconds', '0.2'], 'no transform arrived from /tf and /tf_static'),
    (['--ros-args', '-r', 'nonsense'], 'nonsense'),
    (['--tf-topic', 'a b', '--seconds', '1'], "'a b' is not a valid topic name: ")])
def test_what_cannot_be_heard_is_one_sentence(arguments, sentence):
    done = doctor(*arguments)
    assert (done.returncode, done.stdout) == (2, '')
    # rcl may have logged before.
    line = done.stderr.splitlines()[-1]
    assert line.startswith('tf_doctor: ') and sentence in line
