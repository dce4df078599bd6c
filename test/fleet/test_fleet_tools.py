# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tools by their command lines, on a fleet: without ROS."""

import itertools
import json
import signal
import sys
import threading
import time

from conditions import until
from fleet_helpers import message
from programs import Program
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.fleet import RobotPublisher
from tool_helpers import assert_one_sentence, started, tool

NOBODY = 'tcp/127.0.0.1:9'


@pytest.fixture(scope='module')
def hall(router, session):
    """Return the address of a router with two robots that move, at some 50 Hz."""
    ended = threading.Event()
    robots = [RobotPublisher(session, f'robot{number}') for number in (7, 8)]
    for robot in robots:
        robot.send_static(message(('base', 'fork', 0.5)))

    def move():
        for turn in itertools.count():
            if ended.wait(0.02):
                return
            stamp = time.time_ns()
            for place, robot in enumerate(robots):
                robot.send(message(('map', 'base', place + 0.001 * turn), stamp=stamp))

    moving = threading.Thread(target=move)
    moving.start()
    yield router
    ended.set()
    moving.join()
    for robot in robots:
        robot.close()


def test_echo_answers_across_robots(hall):
    done = tool('tf_echo', 'robot7/fork', 'robot8/fork', '--fleet', hall, '--once', '--json')
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout.splitlines()[-1])
    assert answer['translation'][0] == pytest.approx(1.0)
    assert {edge['authority'] for edge in answer['edges']} == {'robot7', 'robot8'}


def test_doctor_and_frames_tell_of_the_robots_that_are_meant(hall, tmp_path):
    done = tool('tf_doctor', '--fleet', hall, '--seconds', 1, '--json')
    report = json.loads(done.stdout)
    assert (done.returncode, report['errors'], report['frames']) == (0, 0, 5)
    path = tmp_path / 'frames.json'
    done = tool('tf_frames', '--fleet', hall, '--robots', 'robot8,robot9', '--seconds', 1,
                '-o', path)
    assert done.returncode == 0, done.stderr
    assert {edge['child'] for edge in json.loads(path.read_text())['edges']} == {
        'robot8/base', 'robot8/fork'}


def test_doctor_tells_of_a_robot_that_says_where_the_shared_frame_is(hall, session):
    with RobotPublisher(session, 'robot9') as robot:
        robot.send_static(message(('earth', 'map', 1), ('map', 'base', 2)))
        done = tool('tf_doctor', '--fleet', hall, '--robots', 'robot9', '--seconds', 1, '--json')
    (finding,) = [one for one in json.loads(done.stdout)['findings']
                  if one['code'] == 'two_parents']
    assert (finding['severity'], finding['frames'], finding['publishers']) == (
        'warning', ['robot9/earth', 'map'], ['robot9'])


def test_monitor_tells_of_every_edge(hall):
    done = tool('tf_monitor', '--fleet', hall, '--seconds', 1, '--period', 0.5, '--json')
    assert done.returncode == 0, done.stderr
    edges = json.loads(done.stdout.splitlines()[-1])['edges']
    assert {(edge['parent'], edge['child']) for edge in edges} == {
        (parent, child) for robot in ('robot7', 'robot8')
        for parent, child in (('map', f'{robot}/base'), (f'{robot}/base', f'{robot}/fork'))}


def test_recorder_writes_what_the_robots_sent(hall, tmp_path):
    """Completely, although Ctrl-C comes as soon as the bag is there."""
    program = started('tf_record', '--fleet', hall, '-o', tmp_path, '--last', 5)
    try:
        program.wait_for('keeping the last 5 s')
        assert '~/dump' not in program.output
        until(lambda: program.interrupt(signal.SIGUSR1) or list(tmp_path.glob('*.mcap')))
        program.interrupt()
        assert program.end() == 0, program.output
    finally:
        program.kill()
    story, bag = sorted(tmp_path.iterdir())
    assert json.loads(story.read_text())['bag'] == bag.name
    assert f'{bag}: asked: requested by SIGUSR1' in program.output
    buffer = open_bag(bag)
    assert buffer.lookup('robot7/fork', 'robot8/fork').x == pytest.approx(1.0)


def test_view_shows_a_fleet(hall):
    pytest.importorskip('viser')
    program = Program(sys.executable, '-m', 'tf_tree_py.view.tf_view', '--fleet', hall)
    try:
        program.wait_for(f'{hall} is shown at http://')
        program.interrupt()
        assert program.end() == 0
    finally:
        program.kill()


def test_a_router_that_is_not_there_is_told(impatient):
    done = tool('tf_echo', 'map', 'base', '--fleet', NOBODY, '--once', '--seconds', 0.1)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        f'tf_echo: no transform arrived from {NOBODY}; there is no connection to {NOBODY}: '
        f'{NOBODY.removeprefix("tcp/")} cannot be reached: Connection refused')


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (('--fleet', 'hall'), "'hall' is not the address of a router"),
    (('--fleet', NOBODY, '--bag', 'run.mcap'), '--bag and --fleet cannot be used together'),
    (('--fleet-config', 'nothing.json5'), 'nothing.json5: there is no such configuration file'),
    (('--fleet', NOBODY, '--robots', 'a//b'), "'a//b' cannot match a robot in Zenoh keys"),
    (('--fleet', NOBODY, '--robots', ','), 'no robots are selected'),
])
def test_wrong_arguments_are_one_sentence(arguments, sentence):
    assert_one_sentence(tool('tf_echo', 'map', 'base', *arguments), 'tf_echo', sentence)
