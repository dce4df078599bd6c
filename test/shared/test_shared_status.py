# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The status of shared trees, and ``tf_share --status``, which prints it without ROS."""

from contextlib import contextmanager
import json
import os
import signal
import subprocess
import sys

from conditions import until
from programs import completed, without
import pytest
from sharing_trees import new_place, shared, SharingBuffer, WriterProcess
from tf_tree_py.nodes import share_status
from tf_tree_py.shared import layout, place as place_module
from tf_tree_py.shared.place import hold, Place
from tf_tree_py.shared.shared_tree import SharedTree
from tf_tree_py.shared.sharing import share
from tf_tree_py.shared.status import all_statuses, readers_of, Status, status_of

MS = 10 ** 6
HERE = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
RECEPTION = {'topics': ['/tf', '/tf_static'], 'use_sim_time': False, 'frame_prefix': 'r1/',
             'shared_frames': ['map'], 'frame_filter': None}
HOW_TO_START = 'start one with: ros2 run tf_tree_py tf_share'

# Attaches to a tree, and waits for a line of input.
_READER = """
import sys
from tf_tree_py.shared.shared_tree import SharedTree
with SharedTree(domain_id=int(sys.argv[1])):
    print('reads', flush=True)
    sys.stdin.readline()
"""
# The executable as pip installs it, with trees in another folder.
_COMMAND = without('rclpy', 'rcl_interfaces', 'tf2_msgs') + """
from pathlib import Path
from tf_tree_py.shared import place
place.SHARED_MEMORY = Path(sys.argv.pop(1))
from tf_tree_py.nodes import starting
sys.exit(starting.tf_share())
"""


@pytest.fixture
def domain_id():
    with new_place() as domain_id:
        yield domain_id


@pytest.fixture
def place(domain_id):
    return Place(domain_id)


@pytest.fixture
def memory(tmp_path, monkeypatch):
    """Let the trees of this process lie in a folder of the test, where no others are."""
    monkeypatch.setattr(place_module, 'SHARED_MEMORY', tmp_path)
    return tmp_path


@pytest.fixture
def command(memory, capsys):
    """Run the command in this process; return its exit status and its output."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def run(*arguments):
        status = share_status.main(['tf_share', '--status', *arguments])
        for number, handler in handlers.items():
            signal.signal(number, handler)
        printed = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, status, printed.out, printed.err)

    return run


@contextmanager
def reader_of(domain_id):
    """Yield the number of another process, which is attached to a tree."""
    with subprocess.Popen([sys.executable, '-c', _READER, str(domain_id)], text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == 'reads\n'
        yield process.pid
        process.communicate('\n')


@contextmanager
def damaged(place, content):
    """Put something else at a place whose writer lives."""
    place.make_folder()
    held = hold(place)
    place.memory.write_bytes(content)
    yield
    os.close(held)


# --- statuses

def test_status_has_the_figures_of_the_tree(place):
    buffer = SharingBuffer(20 * MS)
    buffer.insert('map', 'odom', MS, HERE)
    buffer.insert('odom', 'base', MS, HERE, static=True)
    with share(buffer, place, RECEPTION):
        status = status_of(place)
        assert status == Status(
            place.memory, '', os.getpid(), status.silence_s, 3, 2, 20 * MS,
            place.memory.stat().st_size, RECEPTION)
        assert status.silence_s >= 0.0
        assert status.sentence == (
            f'process {os.getpid()}, alive {status.silence_s:.2f} s '
            f'ago: 3 frames, 2 edges, 20 ms of history, {status.size / 1e6:.1f} MB')
        assert status.as_dict() == {
            'file': str(place.memory), 'problem': '', 'pid': os.getpid(),
            'silence_s': status.silence_s, 'frames': 3, 'edges': 2, 'cache_time': 0.02,
            'size': status.size, 'reception': RECEPTION}


def test_place_without_a_tree_has_no_status(place):
    assert status_of(place) is None
    with share(SharingBuffer(), place):
        assert not status_of(place).problem
    assert status_of(place) is None
    assert place.memory not in [status.file for status in all_statuses()]


def test_all_trees_of_this_user_have_one(domain_id):
    topics = ['/robot1/tf', '/robot1/tf_static']
    places = [Place(domain_id), Place(domain_id, topics)]
    with WriterProcess(domain_id) as writer, share(SharingBuffer(), places[1]):
        own = {status.file: status for status in all_statuses()
               if status.file in [place.memory for place in places]}
    assert [own[place.memory].pid for place in places] == [writer.pid, os.getpid()]
    assert [own[place.memory].problem for place in places] == ['', '']
    assert [own[place.memory].frames for place in places] == [2, 0]


def test_there_is_none_where_nobody_ever_shared(memory):
    assert all_statuses() == []


def test_dead_process_is_a_problem(domain_id, place):
    with WriterProcess(domain_id):
        until(lambda: not status_of(place).problem)
    status = status_of(place)
    assert status.file == place.memory
    assert status.problem.endswith(HOW_TO_START)


def test_stopped_process_is_a_problem(domain_id, place):
    with WriterProcess(domain_id) as writer:
        writer.signal(signal.SIGSTOP)
        until(lambda: status_of(place).problem)
        assert f'kill -CONT {writer.pid}' in status_of(place).problem
        writer.signal(signal.SIGCONT)
        until(lambda: not status_of(place).problem)


@pytest.mark.parametrize(('content', 'why'), [
    (b'', 'it is too short'), (bytes(layout.PAGE), 'it is not a tree of this version'),
], ids=['short', 'zeros'])
def test_damaged_file_is_a_problem(place, content, why):
    with damaged(place, content):
        problem = status_of(place).problem
        assert problem.startswith(f'{place.memory} cannot be read: {why}')
        (listed,) = [each for each in all_statuses() if each.file == place.memory]
        assert listed.problem.startswith(f'{place.memory} cannot be read: {why}')


# --- readers

def test_readers_are_others_that_are_attached(domain_id, place):
    with WriterProcess(domain_id), SharedTree(domain_id=domain_id):
        assert readers_of(status_of(place)) == []
        with reader_of(domain_id) as first, reader_of(domain_id) as second:
            assert readers_of(status_of(place)) == sorted([first, second])
        assert readers_of(status_of(place)) == []


def test_readers_of_another_tree_are_not_listed(domain_id, place):
    topics = ['/robot1/tf', '/robot1/tf_static']
    with share(SharingBuffer(), place), share(SharingBuffer(), Place(domain_id, topics)), \
            reader_of(domain_id) as reader:
        assert readers_of(status_of(place)) == [reader]
        assert readers_of(status_of(Place(domain_id, topics))) == []


# --- the command

def test_command_tells_of_each_tree(command):
    buffer = SharingBuffer()
    buffer.insert('map', 'odom', MS, HERE)
    with share(buffer, Place(1), RECEPTION), share(SharingBuffer(), Place(2)):
        done = command()
    assert (done.returncode, done.stderr) == (0, '')
    first, second = (part.splitlines() for part in done.stdout.split('\n\n'))
    assert first[0] == str(Place(1).memory)
    assert first[1].startswith(f'  shared by process {os.getpid()}, alive ')
    assert first[1].split(': ')[1].startswith('2 frames, 1 edge, 10.000 s of history, ')
    assert first[2:] == [
        "  topics    /tf, /tf_static, frame_prefix=r1/, shared_frames=['map']",
        '  readers   none']
    assert second[0] == str(Place(2).memory)


def test_command_tells_of_readers():
    """Of trees at the usual place, where those of others may be, too."""
    with shared(SharingBuffer()) as (domain_id, _), reader_of(domain_id) as reader:
        done = completed(sys.executable, '-c', _COMMAND, '/dev/shm', '--status')
    (own,) = [part for part in done.stdout.split('\n\n') if str(Place(domain_id).memory) in part]
    assert own.splitlines()[-1] == f'  readers   {reader}'


def test_command_says_what_cannot_be_read_and_returns_1(command):
    with share(SharingBuffer(), Place(1)), damaged(Place(2), b''):
        done = command()
        assert done.returncode == 1
        first, second = (part.splitlines() for part in done.stdout.split('\n\n'))
        assert first[1].startswith('  shared by ')
        assert second[0] == str(Place(2).memory)
        (line,) = second[1:]
        assert line.startswith(f'  problem   {Place(2).memory} cannot be read: it is too short')
        assert command('--json').returncode == 1


def test_command_without_a_tree_is_one_sentence(command):
    done = command()
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == f'tf_share: no process of this user shares a tree: {HOW_TO_START}\n'


def test_json_has_every_field(command):
    with share(SharingBuffer(), Place(1), RECEPTION), damaged(Place(2), b''):
        first, second = json.loads(command('--json').stdout)
    assert first.keys() == second.keys() == {*Status._fields, 'readers'}
    assert first == {
        'file': str(Place(1).memory), 'problem': '', 'pid': os.getpid(),
        'silence_s': first['silence_s'], 'frames': 0, 'edges': 0, 'cache_time': 10.0,
        'size': first['size'], 'reception': RECEPTION, 'readers': []}
    assert first['size'] > 0
    assert second['file'] == str(Place(2).memory)
    assert 'it is too short' in second['problem']


def test_json_without_a_tree_is_an_empty_list(command):
    done = command('--json')
    assert (done.returncode, json.loads(done.stdout)) == (2, [])


def test_command_on_another_machine_is_one_sentence(command, monkeypatch):
    monkeypatch.setattr(layout.platform, 'machine', lambda: 'riscv64')
    done = command()
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith('tf_share: ') and done.stderr.count('\n') == 1
    assert 'cannot be shared on riscv64' in done.stderr


def test_command_needs_no_ros(memory):
    arguments = sys.executable, '-c', _COMMAND, str(memory), '--status'
    with share(SharingBuffer(), Place(1), RECEPTION):
        done = completed(*arguments)
        assert (done.returncode, done.stderr) == (0, '')
        assert f'shared by process {os.getpid()}, ' in done.stdout
        (status,) = json.loads(completed(*arguments, '--json').stdout)
        assert status['pid'] == os.getpid()
        assert status['readers'] == []  # the writer and the command are none
    done = completed(*arguments)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith('tf_share: no process of this user shares a tree')
