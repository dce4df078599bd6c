# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The process that receives transforms once, and shares the tree with others."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
import gc
import itertools
import json
import os
import signal
import threading

from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from ros_helpers import result_of, SimClock, Talker, transform, until
from sharing_trees import error_of, files_of, remove_files
from tf_tree_py import SharedTree, SharedTreeException
from tf_tree_py.core import Pose
from tf_tree_py.nodes import tf_share
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.tf_share import TfShare
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.shared.place import Place

SECOND = 1_000_000_000
# The last second of a stamp in a message.
FAR = 2**31 - 1
TURNED = Pose(0.1, -2e300, 3e-300, 0.5, -0.5, 0.5, -0.5)


@pytest.fixture(autouse=True)
def place(monkeypatch):
    """Return the place of the topics' usual names, which is empty afterwards."""
    monkeypatch.delenv('TF_TREE_SHARED', raising=False)
    place = Place()
    yield place
    remove_files(place)


@pytest.fixture
def share(start):
    """Start processes that share, and return each when it does."""
    def begin(*ros_arguments):
        program = start('tf_share', '--ros-args', *ros_arguments)
        program.wait_for('Sharing ')
        return program

    return begin


@pytest.fixture
def talker(context):
    node = Node('talking', context=context)
    yield Talker(node)
    node.destroy_node()


@pytest.fixture
def pool():
    """Yield threads for lookups while the test continues."""
    with ThreadPoolExecutor() as threads:
        yield threads


@contextmanager
def sharing(context, **parameters):
    """Share in this process; yield the node, which is not spun."""
    node = TfShare(context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])
    try:
        yield node
    finally:
        node.destroy_node()


def waiting_lookup(tree, pool, *frames):
    """Return the future of a lookup that waits."""
    future = pool.submit(tree.lookup_within, PATIENCE_S, *frames)
    until(lambda: len(tree.waiting) or future.done())
    assert not future.done()
    return future


def descriptors_of(place):
    """Return the files of a place's folder that this process has open."""
    links = []
    for descriptor in os.listdir('/proc/self/fd'):
        with suppress(FileNotFoundError):  # the one that listed the folder
            links.append(os.readlink(f'/proc/self/fd/{descriptor}'))
    return [link for link in links if link.startswith(str(place.memory.parent))]


def collected():
    """Collect garbage: a mapped file is closed with the last object that refers to it."""
    gc.collect()
    return True


# --- sharing

def test_process_shares_what_is_published_to_the_last_bit(share, talker, buffer, pool):
    share()
    with SharedTree() as tree:
        assert tree.frames() == []
        answer = waiting_lookup(tree, pool, 'map', 'camera', 2 * SECOND)
        talker.fix(transform_stamped('base', 'camera', 0, TURNED))
        for second in (1, 4):
            talker.move(transform_stamped('map', 'base', second * SECOND, Pose(
                0.1 * second, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8)), listeners=2)
        for stamp in (SECOND, 2 * SECOND, 4 * SECOND):
            for target, source in (('map', 'camera'), ('camera', 'map'), ('map', 'base')):
                own = buffer.lookup_within(PATIENCE_S, target, source, stamp)
                assert tree.lookup_within(PATIENCE_S, target, source, stamp) == own
        assert answer.result(PATIENCE_S) == tree.lookup('map', 'camera', 2 * SECOND)
        assert tree.lookup('base', 'camera') == TURNED
        assert {(edge.parent, edge.child) for edge in tree.edges()} == {
            ('map', 'base'), ('base', 'camera')}


def test_process_prints_where_the_tree_is(share, place):
    program = share()
    assert place.memory.exists()
    (line,) = program.output.splitlines()
    assert line.endswith(
        f'Sharing /tf and /tf_static of domain {os.environ["ROS_DOMAIN_ID"]} in {place.memory}')


def test_process_shares_although_programs_are_to_look_up_in_the_tree(
        share, talker, monkeypatch):
    """The environment of a whole system says so, and tf_share is a part of it."""
    monkeypatch.setenv('TF_TREE_SHARED', str(PATIENCE_S))
    share()
    with SharedTree() as tree:
        talker.move(transform('map', 'base', x=1.0))
        assert tree.lookup_within(PATIENCE_S, 'map', 'base').x == 1.0


def test_second_process_names_the_first_one(share, start, talker):
    first = share()
    second = start('tf_share')
    assert second.end() == 2
    assert second.output == (
        f'tf_share: The process {first.pid} already shares /tf and /tf_static of domain '
        f'{os.environ["ROS_DOMAIN_ID"]}, and only one can\n')
    with SharedTree() as tree:
        talker.fix(transform('base', 'camera', x=1.0))
        assert tree.lookup_within(PATIENCE_S, 'base', 'camera').x == 1.0


@pytest.mark.parametrize(('arguments', 'topics'), [
    (['-r', '/tf:=/r2/tf', '-r', '/tf_static:=/r2/tf_static'], ['/r2/tf', '/r2/tf_static']),
    (['-p', 'tf_topic:=/r2/tf'], ['/r2/tf', '/tf_static']),
    (['-r', '__ns:=/r2', '-p', 'tf_topic:=tf', '-p', 'tf_static_topic:=fixed'],
     ['/r2/tf', '/r2/fixed']),
], ids=['remapped', 'parameter', 'namespace'])
def test_process_for_other_topics_runs_beside(share, talker, arguments, topics):
    share()
    share(*arguments)
    with SharedTree() as tree, SharedTree(topics=topics) as other:
        assert other.reception['topics'] == topics
        assert tree.reception['topics'] == ['/tf', '/tf_static']
        for topic, frame in (('/tf', 'one'), (topics[0], 'two')):
            talker.send(_message(transform('map', frame)), topic)
        for one, frame in ((tree, 'one'), (other, 'two')):
            one.lookup_within(PATIENCE_S, 'map', frame)
            assert set(one.frames()) == {'map', frame}


def _message(*transforms):
    from tf2_msgs.msg import TFMessage
    return TFMessage(transforms=transforms)


# --- the end

@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGTERM], ids=['SIGINT', 'SIGTERM'])
def test_signal_ends_it_and_readers_are_told(share, place, pool, end):
    program = share()
    reason = f'The process {program.pid}, which shared .*, has ended: it was stopped'
    with SharedTree() as tree:
        answer = waiting_lookup(tree, pool, 'map', 'base')
        program.interrupt(end)
        with pytest.raises(SharedTreeException, match=reason):
            answer.result(PATIENCE_S)
        assert program.end() == 0
        for ask in (tree.frames, lambda: tree.lookup('map', 'base')):
            with pytest.raises(SharedTreeException, match=reason):
                ask()
    assert program.output.count('\n') == 1
    assert {*files_of(place)} <= {place.lock}


def test_impatient_ctrl_c_ends_it_in_order(share, place):
    program = share()
    program.interrupt_until_it_ends()
    assert program.end() == 0
    assert program.output.count('\n') == 1
    assert {*files_of(place)} <= {place.lock}


def test_killed_process_is_named_and_the_next_one_is_joined(share, talker, pool):
    first = share()
    with SharedTree() as tree:
        talker.move(transform('map', 'base', x=1.0))
        assert tree.lookup_within(PATIENCE_S, 'map', 'base').x == 1.0
        answer = waiting_lookup(tree, pool, 'map', 'base', 2 * SECOND)
        first.interrupt(signal.SIGKILL)
        reason = f'The process {first.pid}, which shared .*, has died'
        with pytest.raises(SharedTreeException, match=reason):
            answer.result(PATIENCE_S)
        with pytest.raises(SharedTreeException, match=reason):
            tree.lookup('map', 'base')
        second = share()
        # Late subscribers get it, too: the killed one still seems to be there.
        talker.fix(transform('base', 'camera', x=2.0))
        assert tree.lookup_within(PATIENCE_S, 'base', 'camera').x == 2.0
        assert 'map' not in tree.frames()
        assert str(second.pid) in tree.attachment.who


def test_removed_file_ends_it_with_the_reason(share, place):
    program = share()
    with SharedTree() as tree:
        place.memory.unlink()
        assert program.end() == 2
        assert error_of(tree.frames)
    assert program.output.splitlines()[1:] == [
        'tf_share: sharing has ended: its file was removed']


@pytest.mark.parametrize('shuts_down', [False, True], ids=['destroyed', 'after_shutdown'])
def test_end_of_the_node_leaves_no_thread_and_no_file(context, place, shuts_down):
    others = {*threading.enumerate()}
    node = TfShare(context=context)
    assert {*threading.enumerate()} - others
    assert place.memory.exists() and descriptors_of(place)
    if shuts_down:
        context.shutdown()
    for _ in range(2):
        node.destroy_node()
    until(lambda: {*threading.enumerate()} <= others)
    assert {*files_of(place)} <= {place.lock}
    del node
    until(lambda: collected() and descriptors_of(place) == [])
    assert error_of(SharedTree).startswith('No process shares')


def test_next_node_of_the_process_shares_again(context):
    for _ in range(2):
        with sharing(context), SharedTree() as tree:
            assert tree.frames() == []


def test_node_that_cannot_listen_leaves_no_thread_and_no_file(context, place, monkeypatch):
    def fail(*_, **__):
        raise RuntimeError('no listener')

    monkeypatch.setattr(tf_share, 'TransformListener', fail)
    others = {*threading.enumerate()}
    with pytest.raises(RuntimeError, match='no listener'):
        TfShare(context=context)
    until(lambda: {*threading.enumerate()} <= others)
    assert {*files_of(place)} <= {place.lock}
    until(lambda: collected() and descriptors_of(place) == [])


def test_second_node_of_a_process_is_refused(context):
    with sharing(context), SharedTree() as tree:
        with pytest.raises(BadInput, match=f'The process {os.getpid()} already shares'):
            TfShare(context=context)
        assert tree.frames() == []


# --- parameters

FRAMES = {'map', 'r1/odom', 'r1/base', 'r1/imu', 'r1/camera'}


@pytest.mark.parametrize(('parameters', 'frames'), [
    ({}, FRAMES),
    ({'frame_prefix': 'x/'}, {f'x/{frame}' for frame in FRAMES}),
    ({'frame_prefix': 'x/', 'shared_frames': ['map']},
     {'map', *(f'x/{frame}' for frame in FRAMES - {'map'})}),
    ({'strip_frame_prefix': 'r1/', 'shared_frames': ['map']},
     {'map', 'odom', 'base', 'imu', 'camera'}),
    ({'strip_frame_prefix': 'r1/', 'frame_prefix': 'r2/'},
     {'r2/odom', 'r2/base', 'r2/imu', 'r2/camera'}),
    ({'frame_filter': ['map', 'r1/imu', 'r1/odom']}, {'map', 'r1/imu', 'r1/odom'}),
], ids=['none', 'prefix', 'prefix_and_shared', 'strip_and_shared', 'strip_and_prefix', 'filter'])
def test_frames_are_named_and_chosen_as_the_parameters_say(context, talker, parameters, frames):
    with sharing(context, **parameters), SharedTree() as tree:
        said = {name: tree.reception[name] for name in parameters}
        assert said == parameters
        # At least one edge of each message is taken, and a message becomes visible as a whole.
        talker.fix(transform('r1/odom', 'r1/imu'), transform('r1/base', 'r1/camera'))
        talker.move(transform('map', 'r1/odom'), transform('r1/odom', 'r1/base'))
        until(lambda: frames <= {*tree.frames()})
        assert {*tree.frames()} == frames


def test_moving_transforms_may_be_left_out(context, talker):
    with sharing(context, static_only=True) as node, SharedTree() as tree:
        assert tree.reception['static_only'] is True
        talker.fix(transform('base', 'camera'))
        assert tree.lookup_within(PATIENCE_S, 'base', 'camera')
        assert node.count_subscribers('/tf_static') == 1
        assert node.count_subscribers('/tf') == 0


def test_parameters_of_the_command_line_are_shared(share, talker):
    share('-p', 'buffer_size:=3', '-p', 'frame_prefix:=r2/', '-p', 'strip_frame_prefix:=r1/',
          '-p', 'shared_frames:=[map]', '-p', 'frame_filter:=[r1/odom, map, r1/base]',
          '-p', 'static_only:=false', '-p', 'use_sim_time:=true')
    with SharedTree() as tree:
        assert dict(tree.reception) == {
            'domain_id': int(os.environ['ROS_DOMAIN_ID']), 'topics': ['/tf', '/tf_static'],
            'use_sim_time': True, 'static_only': False,
            'frame_prefix': 'r2/', 'strip_frame_prefix': 'r1/', 'shared_frames': ['map'],
            'frame_filter': ['map', 'r1/base', 'r1/odom']}
        assert tree.cache_time == 3 * SECOND
        talker.move(transform('map', 'r1/odom'), transform('map', 'r1/lamp'))
        tree.lookup_within(PATIENCE_S, 'map', 'r2/odom')
        assert {*tree.frames()} == {'map', 'r2/odom'}


def test_use_of_simulated_time_is_told_when_it_changes(share, robot_node):
    share()
    client = AsyncParameterClient(robot_node, 'tf_share')
    assert client.wait_for_services(PATIENCE_S)
    with SharedTree() as tree:
        for value in (True, False):
            answer = result_of(client.set_parameters([Parameter('use_sim_time', value=value)]))
            assert answer.results[0].successful
            assert tree.reception['use_sim_time'] is value
        answer = result_of(client.set_parameters([Parameter('frame_prefix', value='r3/')]))
        assert not answer.results[0].successful
        assert tree.reception['frame_prefix'] == ''


def test_change_to_simulated_time_clears_moving_transforms(context, talker):
    with sharing(context) as node, SharedTree() as tree:
        talker.fix(transform('base', 'camera', x=1.0))
        talker.move(transform('map', 'base'))
        tree.lookup_within(PATIENCE_S, 'map', 'camera')
        node.set_parameters([Parameter('use_sim_time', value=True)])
        assert tree.reception['use_sim_time'] is True
        until(lambda: not len(tree.stamps_of('base')))
        assert tree.lookup('base', 'camera').x == 1.0


def test_step_back_of_simulated_time_clears_moving_transforms(context, talker):
    clock = SimClock(talker.node)
    with sharing(context, use_sim_time=True, clear_on_clock_jump_back=0.5), \
            SharedTree() as tree:
        talker.move(transform('map', 'base', 99.0))
        tree.lookup_within(PATIENCE_S, 'map', 'base')
        # A subscription of /clock keeps the newest message only, so any may be lost.
        seconds = itertools.cycle((100.0, 99.3))
        until(lambda: not len(tree.stamps_of('base')) or clock.show(next(seconds)))


def test_stamps_that_jump_back_clear_moving_transforms(context, talker):
    with sharing(context, clear_on_jump_back=5.0), SharedTree() as tree:
        for second in (99.0, 100.0, 91.0, 92.0, 93.0):
            talker.move(transform('map', 'base', second))
        until(lambda: tree.stamps_of('base').tolist()[-1:] == [93 * SECOND])


@pytest.mark.parametrize(('parameters', 'stamps'), [
    ({'max_future': 60.0}, [SECOND]), ({}, [SECOND, FAR * SECOND])], ids=['refused', 'default'])
def test_stamps_of_the_far_future(context, talker, parameters, stamps):
    with sharing(context, buffer_size=1e9, **parameters), SharedTree() as tree:
        talker.move(transform('map', 'base', 1.0), transform('map', 'base', FAR))
        tree.lookup_within(PATIENCE_S, 'map', 'base', SECOND)
        assert tree.stamps_of('base').tolist()[-1] == stamps[-1]


@pytest.mark.parametrize(('name', 'value', 'sentence'), [
    ('tf_topic', 'a b', "must be a topic name, not 'a b'"),
    ('tf_static_topic', '', "must be a topic name, not ''"),
    ('static_only', 'yes', "must be true or false, not 'yes'"),
    ('frame_prefix', 3, 'must be a string, not 3'),
    ('strip_frame_prefix', True, 'must be a string, not True'),
    ('shared_frames', [1, 2], 'must be a list of strings'),
    ('frame_filter', [1.5], 'must be a list of strings'),
    ('buffer_size', 0.0, 'must be a number from 0.001 to 1000000000.0, not 0.0'),
    ('max_future', -1.0, 'must be a number from 0.0 to'),
    ('clear_on_jump_back', -1.0, 'must be a number from 0.0 to'),
    ('clear_on_clock_jump_back', 'often', 'must be a number from 0.0 to'),
], ids=lambda given: given if isinstance(given, str) and '_' in given else '')
def test_parameter_that_cannot_be_is_refused(context, place, name, value, sentence):
    with pytest.raises(BadInput, match=f'parameter {name} {sentence}'), \
            sharing(context, **{name: value}):
        pass
    assert {*files_of(place)} <= {place.lock}


@pytest.mark.parametrize(('parameter', 'said'), [
    ('buffer_size:=long', 'parameter buffer_size must be a number from'),
    ('tf_topic:=/a//b', "parameter tf_topic must be a topic name, not '/a//b'"),
], ids=['number', 'topic'])
def test_mistake_in_a_parameter_is_one_sentence(start, parameter, said):
    program = start('tf_share', '--ros-args', '-p', parameter)
    assert program.end() == 2
    assert program.output.startswith(f'tf_share: {said}')
    assert program.output.count('\n') == 1


def test_unknown_parameter_is_told_with_what_was_meant(share):
    program = share('-p', 'bufer_size:=3')
    assert "no parameter 'bufer_size'" in program.output
    assert "did you mean 'buffer_size'?" in program.output


# --- the command line

def test_status_of_a_process_tells_its_readers(share, start, place):
    program = share()
    with SharedTree():
        status = start('tf_share', '--status', '--json')
        # Other tests may share trees at the same time, and break them.
        assert status.end() in (0, 1)
    (own,) = [each for each in json.loads(status.output) if each['file'] == str(place.memory)]
    assert (own['pid'], own['problem'], own['readers']) == (program.pid, '', [os.getpid()])
    assert own['reception']['topics'] == ['/tf', '/tf_static']


def test_mistake_in_arguments_is_one_sentence(capsys):
    with pytest.raises(SystemExit) as ended:
        tf_share.main(['tf_share', '--size', '3'])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said == 'tf_share: unrecognized arguments: --size 3 (see --help)\n'


def test_help_tells_every_parameter(capsys):
    with pytest.raises(SystemExit) as ended:
        tf_share.main(['tf_share', '--help'])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert all(setting.name in said for setting in tf_share.SETTINGS)
    assert '--status' in said
