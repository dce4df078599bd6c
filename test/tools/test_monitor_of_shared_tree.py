# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The row of tf_monitor about the tree that tf_share shares beside it."""

import json
import signal

from bags import write_ros2
from conditions import until
from patients import HEALTHY
from programs import executable, Program
import pytest
from sharing_trees import remove_files
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.status import Status
from tool_helpers import command, tool

pytest.importorskip('rclpy')

TOPICS = ['/tf', '/tf_static']


@pytest.fixture(scope='module', autouse=True)
def robot():
    program = Program(*executable('five_frame_publisher'))
    yield program
    program.kill()


@pytest.fixture(autouse=True)
def place():
    """Return the place of the shared tree, which is empty afterwards."""
    place = Place()
    yield place
    remove_files(place)


@pytest.fixture
def share(start_program):
    """Start a process that shares, and return it when it does."""
    def begin():
        program = start_program(*executable('tf_share'))
        program.wait_for('Sharing ')
        return program

    return begin


@pytest.fixture
def monitor(start_program):
    return lambda *arguments: start_program(*command('tf_monitor'), '--period', '0.2', *arguments)


def newest(monitor):
    """Return the last look of a monitor that prints JSON, when there is one."""
    until(lambda: monitor.output)
    return json.loads(monitor.output.splitlines()[-1])


def until_looked(monitor, condition):
    """Return the first look that is as wanted."""
    until(lambda: condition(newest(monitor)))
    return next(look for look in map(json.loads, monitor.output.splitlines()) if condition(look))


def until_received(*monitors):
    """Wait until monitors have received all transforms themselves."""
    for each in monitors:
        for frame in ('odom', 'base_link', 'camera', 'gripper'):
            each.wait_for(frame)


def end(*monitors):
    for each in monitors:
        each.interrupt()
        assert each.end() == 0
        assert 'Traceback' not in each.output


def test_process_that_shares_is_told(share, monitor, place):
    table, lines, program = monitor(), monitor('--json'), share()
    look = until_looked(lines, lambda look: look['shared'] and look['shared']['frames'] == 5)
    shared = look['shared']
    assert shared.keys() == {*Status._fields}
    assert (shared['file'], shared['problem'], shared['pid'], shared['edges']) == (
        str(place.memory), '', program.pid, 4)
    assert shared['cache_time'] == 10.0
    assert shared['reception']['topics'] == TOPICS
    assert shared['silence_s'] >= 0.0 and shared['size'] > 0
    table.wait_for(f'shared by process {program.pid}, alive ')
    table.wait_for(' ago: 5 frames, 4 edges')
    until_received(table, lines)
    end(table, lines)
    looks = table.output.split('/tf and /tf_static: ')
    assert looks[-1].count('shared') == 1


def test_without_such_a_process_there_is_no_row(monitor):
    table, lines = monitor(), monitor('--json')
    until_received(table, lines)
    assert newest(lines)['shared'] is None
    end(table, lines)
    assert 'shared' not in table.output


def test_tree_of_other_topics_is_not_told(share, monitor):
    share()
    other, lines = monitor('--json', '--tf-topic', '/r2/tf'), monitor('--json')
    until_looked(lines, lambda look: look['shared'])
    assert newest(other)['shared'] is None
    until_received(lines)
    end(lines)


def test_killed_process_is_a_problem(share, monitor, place):
    table, lines, program = monitor(), monitor('--json'), share()
    until_looked(lines, lambda look: look['shared'] and look['shared']['frames'])
    table.wait_for('shared by ')
    program.interrupt(signal.SIGKILL)
    look = until_looked(lines, lambda look: look['shared'] and look['shared']['problem'])
    assert look['shared']['file'] == str(place.memory)
    assert look['shared'].keys() == {*Status._fields}
    table.wait_for('not shared: ')
    until_received(table, lines)
    end(table, lines)
    assert 'shared by ' not in table.output.split('/tf and /tf_static: ')[-1]


def test_process_that_ends_in_order_is_told_no_more(share, monitor):
    lines, program = monitor('--json'), share()
    until_looked(lines, lambda look: look['shared'])
    program.interrupt()
    assert program.end() == 0
    until(lambda: newest(lines)['shared'] is None)
    until_received(lines)
    end(lines)


def test_recording_has_no_shared_tree(share, tmp_path):
    share()
    messages = sorted(HEALTHY['warehouse_robot'](), key=lambda each: each.received)
    bag = write_ros2(tmp_path / 'bag', messages)
    assert json.loads(tool('tf_monitor', '--bag', bag, '--json').stdout)['shared'] is None
    table = tool('tf_monitor', '--bag', bag).stdout
    assert 'shared by' not in table and 'not shared' not in table
