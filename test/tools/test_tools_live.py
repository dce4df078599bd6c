# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every tool over DDS by its real command line, all with one robot of five frames."""

import json
import signal
import subprocess

from programs import executable, PATIENCE_S, Program
import pytest
from tf_tree_py.bag import open_bag
from tool_helpers import assert_shape, command, started

pytest.importorskip('rclpy')

EDGES = {('world', 'odom'), ('odom', 'base_link'), ('base_link', 'camera'),
         ('base_link', 'gripper')}
# On separate topics, so that the robot has five frames for all other tools.
MOUNTS = """
transforms:
  - {frame_id: mount, child_frame_id: tool, covariance: [1.0e-4, 1.0e-4, 1.0e-4, 0, 0, 0]}
"""


@pytest.fixture(scope='module')
def programs(tmp_path_factory):
    """Return the tools, started at the same time: each needs a moment to find the robot."""
    folder = tmp_path_factory.mktemp('live')
    robot = Program(*executable('five_frame_publisher'))
    mounts = folder / 'mounts.yaml'
    mounts.write_text(MOUNTS)
    tools = {
        'mount': Program(*executable('static_transform_publisher'), '--yaml', str(mounts),
                         '--ros-args', '-r', '/tf_static:=/mounts'),
        'mounted': started('tf_echo', 'mount', 'tool', '--rate', 10, '--explain',
                           '--tf-static-topic', '/mounts'),
        'once': started('tf_echo', 'world', 'gripper', '--once', '--explain', '--seconds', 50),
        'echo': started('tf_echo', 'world', 'griper', '--rate', 10),
        'fresh': started('tf_echo', 'world', 'gripper', '--rate', 10, '--max-age', 50),
        'stale': started('tf_echo', 'world', 'gripper', '--rate', 10, '--max-age', 1e-6),
        'monitor': started('tf_monitor', 'world', 'gripper', '--period', 0.5, '--json'),
        'frames': started('tf_frames', '--seconds', 8, '-o', folder / 'frames.json'),
        # If it were killed before a test has interrupted it, its program would go on.
        'audit': Program(*command('tf_audit'), '--json', '--', *executable('five_frame_listener'),
                         own_terminal=True),
        'record': started('tf_record', '-o', folder, '--every', 0.001),
    }
    tools['folder'] = folder
    yield tools
    robot.kill()
    for program in tools.values():
        if isinstance(program, Program):
            program.kill()


def test_echo_answers_once_and_explains(programs):
    assert programs['once'].end() == 0
    told = programs['once'].output
    assert 'world <- odom <- base_link <- gripper' in told
    assert 'xyz' in told


def test_echo_explains_how_sure_a_mount_is(programs):
    mounted = programs['mounted']
    mounted.wait_for('sigma 1 cm, 0°: mount -> tool 100% of position, 0% of rotation')
    mounted.interrupt()
    assert mounted.end() == 0


def test_echo_says_what_is_missing_and_what_may_be_meant(programs):
    programs['echo'].wait_for("'griper': did you mean 'gripper'?")
    programs['echo'].interrupt()
    assert programs['echo'].end() == 1
    assert 'Traceback' not in programs['echo'].output


def test_echo_refuses_a_latest_that_is_too_old(programs):
    programs['fresh'].wait_for('xyz')
    programs['stale'].wait_for('no answer for world <- gripper: The latest data of the edge ')
    programs['stale'].wait_for(' old, and max_age is 1 us, when looking up')
    for name, status in ('fresh', 0), ('stale', 1):
        programs[name].interrupt()
        assert programs[name].end() == status


def test_monitor_prints_once_in_a_period(programs):
    monitor = programs['monitor']
    monitor.wait_for('"child": "gripper"', count=3)
    monitor.interrupt()
    assert monitor.end() == 0
    look = json.loads(monitor.output.splitlines()[-1])
    assert_shape(look, 'tools', '### A look of tf_monitor')
    assert {(edge['parent'], edge['child']) for edge in look['edges']} == {
        edge for edge in EDGES if edge[1] != 'camera'}
    assert all(edge['publishers'] == ['/five_frame_publisher'] for edge in look['edges'])


def test_audit_tells_what_a_node_looked_up_until_ctrl_c(programs):
    audit = programs['audit']
    audit.wait_for('xyz', count=2)
    audit.interrupt()
    status, said = audit.end(), audit.output
    line, = json.loads(said[said.index('{'):])['lines']
    # The first lookups may have failed before the discovery.
    assert status == int(line['doubtful']) == int(line['failed'] > 0)
    assert line['caller']['file'].endswith('five_frame_listener.py')
    assert (line['target'], line['source'], line['latest']) == ('world', 'gripper', False)
    assert line['lookups'] >= 2


def test_frames_are_all_there(programs):
    assert programs['frames'].end() == 0
    report = json.loads((programs['folder'] / 'frames.json').read_text())
    assert {(edge['parent'], edge['child']) for edge in report['edges']} == EDGES
    assert (report['roots'], report['remarks']) == (['world'], [])


def test_recorder_writes_when_it_is_told_to(programs):
    import rclpy
    from std_srvs.srv import Trigger
    record = programs['record']
    record.wait_for('keeping the last 30 s of /tf and /tf_static')
    count = 0
    while '.mcap: asked' not in record.output:  # nothing is written before data has arrived
        count += 1
        record.interrupt(signal.SIGUSR1)
        record.wait_for('requested by SIGUSR1', count)
    context = rclpy.context.Context()
    rclpy.init(context=context, args=[])
    node = rclpy.create_node('asking', context=context)
    client = node.create_client(Trigger, '/tf_record/dump')
    assert client.wait_for_service(PATIENCE_S)
    client.call_async(Trigger.Request())
    record.wait_for('requested by ~/dump')
    node.destroy_node()
    context.shutdown()
    record.interrupt()
    assert record.end() == 0
    bags = sorted(programs['folder'].glob('*.mcap'))
    assert len(bags) == 2
    assert {(edge.parent, edge.child) for edge in open_bag(bags[-1]).edges()} == EDGES


def test_reader_that_leaves_is_a_normal_end(programs):
    with subprocess.Popen([*command('tf_monitor'), '--period', '0.2', '--json'], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        process.stdout.close()
        assert 'Traceback' not in process.stderr.read()
    assert process.returncode == 0
