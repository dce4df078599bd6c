# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Buffers of nodes that show the tree of another process, and those that cannot."""

import gc
import os
from pathlib import Path
import re
import threading
import time

import domains
from filter_helpers import Inbox, point, run_callbacks
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_helpers import (
    at,
    ended,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    receivers,
    result_of,
    SIM_TIME,
    transform,
    until,
    until_waiting,
    x_of,
)
from tf2_msgs.msg import TFMessage
from tf2_msgs.srv import FrameGraph
from tf_tree_py import (
    Buffer,
    ClockJumpException,
    CovarianceListener,
    FlightRecorder,
    GyroListener,
    Linear,
    LookupException,
    MessageFilter,
    shared_buffer,
    SharedTree,
    SharedTreeException,
    TransformListener,
    UNLIMITED,
)
from tf_tree_py.core.tree.path_finder import PathFinder
from tf_tree_py.ros.buffer.buffer import Buffer as OwnBuffer
from tf_tree_py.ros.topics.reception import TOPICS
from tf_tree_py.shared.errors import LapsedException
from tf_tree_py.shared.place import Place


@pytest.fixture(autouse=True)
def not_from_the_environment(monkeypatch):
    monkeypatch.delenv('TF_TREE_SHARED', raising=False)


def until_left(node, count):
    """Wait until so many subscriptions to /tf are in the graph."""
    until(lambda: node.count_subscribers('/tf') == count)


# --- joining

def test_buffer_with_a_node_joins_and_does_not_subscribe(writer, node, talker):
    buffer = Buffer(node=node, shared=True)
    assert buffer.is_shared and isinstance(buffer, Buffer)
    talker.move(transform('map', 'base', 1.0, x=1.0), transform('map', 'base', 2.0, x=2.0))
    talker.fix(transform('base', 'camera', x=3.0))
    found = buffer.lookup_transform('map', 'camera', at(1.5), PATIENCE)
    assert x_of(found) == 4.5
    assert found == writer.lookup_transform('map', 'camera', at(1.5), PATIENCE)
    until_left(node, 1)
    assert buffer.statistics().accepted == 0


@pytest.mark.parametrize('given', ['1', '0.5'])
def test_environment_lets_a_listener_join(writer, node, listen, talker, monkeypatch, given):
    monkeypatch.setenv('TF_TREE_SHARED', given)
    buffer = Buffer()
    assert not buffer.is_shared, 'a program may fill it by hand'
    listen(node, buffer)
    assert buffer.is_shared
    talker.move(transform('map', 'base', 1.0, x=1.0))
    assert x_of(buffer.lookup_transform('map', 'base', LATEST, PATIENCE)) == 1.0
    until_left(node, 1)


@pytest.mark.parametrize('given', ['', '0'])
def test_environment_can_say_no(writer, node, listen, monkeypatch, given):
    monkeypatch.setenv('TF_TREE_SHARED', given)
    assert not listen(node, Buffer()).is_shared


def test_argument_comes_before_the_environment(writer, node, listen, monkeypatch):
    monkeypatch.setenv('TF_TREE_SHARED', '1')
    assert not listen(node, Buffer(shared=False)).is_shared
    assert not listen(node, OwnBuffer()).is_shared, 'nor tools of this package'


@pytest.mark.parametrize('given', ['yes', '1 s', '-1', 'inf', 'nan'])
def test_environment_that_is_no_number_is_an_error(monkeypatch, given):
    monkeypatch.setenv('TF_TREE_SHARED', given)
    with pytest.raises(ValueError, match=(
            f'TF_TREE_SHARED has to be how many seconds .* not {given!r}')):
        Buffer()


def test_buffer_of_all_nodes_of_a_process_joins(writer, node, talker, monkeypatch):
    monkeypatch.setenv('TF_TREE_SHARED', '1')
    buffer = shared_buffer(node)
    assert buffer.is_shared and shared_buffer(node) is buffer
    talker.move(transform('map', 'base', 1.0, x=1.0))
    assert buffer.can_transform('map', 'base', LATEST, PATIENCE)


def test_process_that_begins_later_is_waited_for(sharing, make_node, pool):
    asked = pool.submit(Buffer, node=make_node('early'), shared=PATIENCE_S)
    until(lambda: any(thread.name.endswith('receiver') for thread in threading.enumerate())
          or not asked.done())
    with sharing():
        assert asked.result(PATIENCE_S).is_shared


def test_listener_of_a_buffer_that_has_joined_subscribes_to_nothing(writer, node, talker):
    buffer = Buffer(node=node, shared=True)
    for spin_thread in (True, False):
        with TransformListener(buffer, node, spin_thread=spin_thread) as listener:
            assert listener.joined
            talker.move(transform('map', 'base', 1.0 + spin_thread, x=1.0))
            assert buffer.can_transform('map', 'base', at(1.0 + spin_thread), PATIENCE)
    until_left(node, 1)


def test_namespace_and_remapping_choose_the_tree(sharing, make_node, talker):
    remapped = {'namespace': 'r2', 'cli_args': [
        '--ros-args', '-r', '/tf:=tf', '-r', '/tf_static:=tf_static']}
    with sharing() as one, sharing(node=remapped) as two:
        first = Buffer(node=make_node('first'), shared=True)
        second = Buffer(node=make_node('second', **remapped), shared=True)
        one.set_transform(transform('map', 'one'), 'me')
        two.set_transform(transform('map', 'two'), 'me')
        assert set(first.frames()) == {'map', 'one'}
        assert set(second.frames()) == {'map', 'two'}


def test_class_of_a_program_keeps_its_methods(writer, node):
    class Counting(Buffer):
        """A buffer that counts."""

        count = 0

        def lookup_transform(self, *arguments, **options):
            self.count += 1
            return super().lookup_transform(*arguments, **options)

    buffer = Counting(node=node, shared=True)
    assert buffer.is_shared and isinstance(buffer, Counting)
    assert type(buffer).__name__ == 'Counting' and type(buffer).__doc__ == Counting.__doc__
    writer.set_transform(transform('map', 'base'), 'me')
    assert buffer.lookup_transform('map', 'base', LATEST) and buffer.count == 1


def test_thread_of_a_buffer_ends_with_the_node(writer, context):
    before = len(receivers())
    node = Node('short', context=context)
    assert Buffer(node=node, shared=True).is_shared
    assert len(receivers()) == before + 1
    node.destroy_node()
    until(lambda: len(receivers()) == before)


# --- waiting

def test_waits_of_all_kinds_end_when_the_data_arrives(writer, node, talker, pool, executor):
    buffer, inbox = Buffer(node=node, shared=True), Inbox()
    thread = pool.submit(buffer.lookup_transform, 'map', 'base', at(2.0), PATIENCE)
    future = buffer.wait_for_transform_async('map', 'base', at(2.0))
    with MessageFilter(buffer, node, 'map', inbox.receive, on_drop=inbox.lose) as held:
        held.add(point(2.0))
        until_waiting(buffer, 3)
        talker.move(transform('map', 'base', 1.0), transform('map', 'base', 3.0, x=2.0))
        assert x_of(thread.result(PATIENCE_S)) == x_of(result_of(future)) == 1.0
        executor.add_node(node)
        until(lambda: run_callbacks(executor, held) or inbox.delivered)
    assert [x_of(found) for _, found in inbox.delivered] == [1.0]


def test_timeout_passes_while_nothing_arrives(writer, node):
    buffer = Buffer(node=node, shared=True)
    with pytest.raises(LookupException, match=(
            r'\(waited .*\nNothing has been received yet by tf_share')) as failed:
        buffer.lookup_transform('map', 'base', at(1.0), lasting(0.05))
    assert failed.value.waited_s >= 0.05
    with pytest.raises(LookupException):
        result_of(buffer.wait_for_transform_async('map', 'base', at(1.0), lasting(0.05)))


def test_thread_that_wakes_others_does_not_wait_itself(writer, node):
    buffer, hints = Buffer(node=node, shared=True), []

    def wait_again(_):
        with pytest.raises(LookupException) as failed:
            buffer.lookup_transform('map', 'nowhere', LATEST, PATIENCE)
        hints.append(failed.value.hint)

    future = buffer.wait_for_transform_async('map', 'base', LATEST)
    future.add_done_callback(wait_again)
    done = ended(future)
    until_waiting(buffer)
    writer.set_transform(transform('map', 'base'), 'me')
    assert done.wait(PATIENCE_S)
    (hint,) = hints
    assert hint.startswith('Did not wait: this thread delivers the transforms')


def test_end_of_the_writer_ends_waits_and_another_is_joined(sharing, node, pool):
    with sharing() as writer:
        buffer = Buffer(node=node, shared=True)
        writer.set_transform(transform('map', 'base', 1.0, x=1.0), 'me')
        assert x_of(buffer.lookup_transform('map', 'base', at(1.0))) == 1.0
        asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(9.0), PATIENCE)
        future = buffer.wait_for_transform_async('map', 'base', at(9.0))
        until_waiting(buffer, 2)
    for wait in (asked.result, lambda _: result_of(future)):
        with pytest.raises(SharedTreeException, match='has ended: it was stopped'):
            wait(PATIENCE_S)
    with pytest.raises(SharedTreeException, match='start one with: ros2 run tf_tree_py tf_share'):
        buffer.lookup_transform('map', 'base', at(1.0))
    assert not buffer.can_transform('map', 'base', at(1.0))
    with sharing() as writer:
        writer.set_transform(transform('map', 'base', 2.0, x=2.0), 'me')
        assert x_of(buffer.lookup_transform('map', 'base', at(2.0))) == 2.0


# --- simulated time

def test_clock_that_jumps_back_ends_waits_and_the_data_is_forgotten(
        sharing, make_node, sim_clock, pool, log):
    with sharing(node=SIM_TIME) as writer:
        buffer = Buffer(node=make_node('asking', **SIM_TIME), shared=True)
        assert buffer.is_shared
        sim_clock.show(100.0, writer, buffer)
        writer.set_transform(transform('map', 'base', 99.0), 'me')
        asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(101.0), PATIENCE)
        until_waiting(buffer)
        sim_clock.show(10.0, writer, buffer)
        with pytest.raises(ClockJumpException, match='the clock went back by 90'):
            asked.result(PATIENCE_S)
        until(lambda: not buffer.can_transform('map', 'base', at(99.0)))
        until(lambda: 'Detected jump back in time' in log())
        assert log().count('Detected jump back in time') == 1 and 'Traceback' not in log()


def test_timeout_follows_simulated_time(sharing, make_node, sim_clock, pool):
    with sharing(node=SIM_TIME) as writer:
        buffer = Buffer(node=make_node('asking', **SIM_TIME), shared=True)
        sim_clock.show(10.0, writer, buffer)
        asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(10.0), lasting(1.0))
        until_waiting(buffer)
        sim_clock.show(12.0, writer, buffer)
        with pytest.raises(LookupException, match=r'\(waited 2\.000 s for it\)'):
            asked.result(PATIENCE_S)


# --- not joining

ITSELF = 'Receiving transforms in this process, although those of another were asked for: '


def test_without_another_process_the_buffer_receives_itself(node, talker, pool, capfd):
    begin = time.monotonic()
    buffer = Buffer(node=node, shared=0.05)
    assert time.monotonic() - begin >= 0.05
    assert not buffer.is_shared
    (line,) = [line for line in capfd.readouterr().err.splitlines() if ITSELF in line]
    assert line.endswith('start one with: ros2 run tf_tree_py tf_share')
    talker.move(transform('map', 'base', 1.0, x=1.0))
    assert x_of(buffer.lookup_transform('map', 'base', LATEST, PATIENCE)) == 1.0
    buffer.set_transform(transform('map', 'mine'), 'me')
    # A listener of the program adds nothing, and takes nothing away when it ends.
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(2.0), PATIENCE)
    until_waiting(buffer)
    with TransformListener(buffer, node) as listener:
        assert listener.joined
    until_left(node, 1)
    talker.move(transform('map', 'base', 2.0, x=2.0))
    assert x_of(asked.result(PATIENCE_S)) == 2.0
    assert ITSELF not in capfd.readouterr().err


def test_listener_to_another_topic_leaves_the_own_one(make_node, node, talker):
    buffer = Buffer(node=node, shared=0.01)
    with TransformListener(buffer, node, tf_topic='/r2/tf', tf_static_topic='/r2/tf_static'):
        talker.move(transform('map', 'base', 1.0))
        talker.send(TFMessage(transforms=[transform('map', 'other')]), '/r2/tf')
        assert buffer.can_transform('base', 'other', LATEST, PATIENCE)


@pytest.mark.parametrize('options, reason', [
    ({'frame_prefix': 'r1/'}, "it has frame_prefix='', and this listener has 'r1/'"),
    ({'strip_frame_prefix': 'r1/'}, "it has strip_frame_prefix='', and this listener has 'r1/'"),
    ({'static_only': True}, 'it has static_only=False, and this listener has True'),
    ({'frame_filter': ['map', 'base']},
     r"it has frame_filter=None, and this listener has \['base', 'map'\]"),
    ({'frame_filter': lambda *_: True}, "and this listener has 'a function'"),
], ids=lambda given: next(iter(given)) if isinstance(given, dict) else '')
def test_listener_that_would_receive_something_else_subscribes(
        writer, node, listen, capfd, options, reason):
    buffer = listen(node, Buffer(shared=True), **options)
    assert not buffer.is_shared
    assert ITSELF in (log := capfd.readouterr().err)
    assert re.search(f'cannot be used here: .*{reason}', log), log


@pytest.mark.parametrize('options', [
    {'frame_prefix': 'r1/'}, {'strip_frame_prefix': 'r1/', 'shared_frames': ['map', 'earth']},
    {'static_only': True}, {'frame_filter': ['map', 'base']},
], ids=lambda given: next(iter(given)))
def test_listener_with_the_same_options_joins(sharing, node, listen, options):
    with sharing(**options):
        assert listen(node, Buffer(shared=True), **options).is_shared


def test_frames_that_keep_their_names_have_to_be_the_same(sharing, node, listen, capfd):
    with sharing(frame_prefix='r1/', shared_frames=['map']):
        assert not listen(node, Buffer(shared=True), frame_prefix='r1/',
                          shared_frames=['earth']).is_shared
    assert "it has shared_frames=['map'], and this listener has ['earth']" in (
        capfd.readouterr().err)


def test_clock_of_the_node_has_to_be_that_of_the_writer(writer, make_node, listen, capfd):
    assert not listen(make_node('simulated', **SIM_TIME), Buffer(shared=True)).is_shared
    assert 'it has use_sim_time=False, and this listener has True' in capfd.readouterr().err


@pytest.mark.parametrize('options, reason', [
    ({'cache_time': lasting(11.0)}, 'cannot be used here: this buffer has to keep '
                                    '11.000 s, and that keeps 10.000 s'),
    ({'cache_time': UNLIMITED}, 'this buffer has to keep all, and that keeps'),
    ({'max_future': lasting(1.0)}, 'max_future concerns the process that receives them'),
    ({'clear_on_jump_back': lasting(1.0)}, 'clear_on_jump_back concerns'),
], ids=['longer', 'unlimited', 'max_future', 'clear_on_jump_back'])
def test_buffer_that_needs_something_else_receives_itself(
        writer, node, listen, capfd, options, reason):
    assert not listen(node, Buffer(shared=True, **options)).is_shared
    assert re.search(ITSELF + f'.*{reason}', capfd.readouterr().err)


def test_longer_history_than_needed_is_welcome(sharing, node, listen):
    with sharing(cache_time=lasting(60.0)):
        buffer = listen(node, Buffer(lasting(5.0), shared=True))
        assert buffer.is_shared and buffer.cache_time == 60 * 10 ** 9


def test_buffer_that_has_data_or_listeners_of_its_own_receives_itself(
        writer, node, listen, tmp_path, capfd):
    filled = Buffer(shared=True)
    filled.set_transform(transform('map', 'mine'), 'me')
    covered = Buffer(shared=True)
    with CovarianceListener(covered, node):
        assert not listen(node, covered).is_shared
    assert not listen(node, filled).is_shared
    assert filled.can_transform('map', 'mine', LATEST)
    recorded = Buffer(shared=True, flight_recorder=FlightRecorder(tmp_path))
    assert not listen(node, recorded).is_shared
    log = capfd.readouterr().err
    assert log.count('this buffer has transforms or listeners of its own') == 2
    assert 'a flight recorder or diagnostics, need the messages' in log


# --- what a buffer that has joined refuses

@pytest.mark.parametrize('change', [
    lambda buffer: buffer.set_transform(transform('map', 'mine'), 'me'),
    lambda buffer: buffer.set_transform_static(transform('map', 'mine'), 'me'),
    lambda buffer: buffer.insert('map', 'mine', 1, (0.0,) * 6 + (1.0,)),
    lambda buffer: buffer.set_interpolation('base', Linear()),
    lambda buffer: buffer.clear(),
    lambda buffer: buffer.remove_frame('base'),
    lambda buffer: buffer.insert(
        'map', 'base', 2 * 10 ** 9, (0.0,) * 6 + (1.0,), covariance=[[0.0] * 6] * 6),
], ids=['set_transform', 'static', 'insert', 'interpolation', 'clear', 'remove', 'covariance'])
def test_nothing_can_be_changed(writer, node, change):
    buffer = Buffer(node=node, shared=True)
    writer.set_transform(transform('map', 'base'), 'me')
    with pytest.raises(SharedTreeException, match='that of another process, .* cannot be changed'):
        change(buffer)
    assert set(buffer.frames()) == {'map', 'base'}
    assert buffer.lookup_transform('map', 'base', LATEST)


def test_listeners_to_other_topics_are_refused(writer, node):
    buffer = Buffer(node=node, shared=True)
    for listen in (lambda: CovarianceListener(buffer, node),
                   lambda: GyroListener(buffer, node, 'base')):
        with pytest.raises(SharedTreeException, match=r'Buffer\(shared=False\)'):
            listen()
    with pytest.raises(SharedTreeException, match=(
            'no other listener can fill it: it has .*/r2/tf.*Use another buffer')):
        TransformListener(buffer, node, tf_topic='/r2/tf')


def test_tree_of_this_process_is_the_same_without_ros(writer, node, context):
    writer.set_transform(transform('map', 'base', 1.0, x=1.0), 'me')
    buffer = Buffer(node=node, shared=True)
    with SharedTree(domain_id=context.get_domain_id()) as tree:
        assert tree.lookup('map', 'base', 10 ** 9) == buffer.lookup('map', 'base', 10 ** 9)
        assert tree.reception[TOPICS] == ['/tf', '/tf_static']


# --- what comes before the first listener, and beside it

def test_waits_that_are_older_than_the_listener_are_answered(
        writer, node, listen, talker, pool, executor):
    buffer, inbox = Buffer(shared=True), Inbox()
    futures = [buffer.wait_for_transform_async('map', child, LATEST) for child in ('base', 'arm')]
    thread = pool.submit(buffer.lookup_transform, 'map', 'base', LATEST, PATIENCE)
    with MessageFilter(buffer, node, 'map', inbox.receive) as held:
        held.add(point(1.0))
        until_waiting(buffer, 4)
        listen(node, buffer)
        assert buffer.is_shared
        until_waiting(buffer, 4)  # the thread wakes up to wait for the tree of all processes
        later = [buffer.wait_for_transform_async('map', child, LATEST)
                 for child in ('base', 'arm')]
        talker.move(transform('map', 'base', 1.0, x=1.0), transform('map', 'arm', 1.0, x=2.0))
        assert [x_of(result_of(future)) for future in futures + later] == [1.0, 2.0] * 2
        assert x_of(thread.result(PATIENCE_S)) == 1.0
        executor.add_node(node)
        until(lambda: run_callbacks(executor, held) or inbox.delivered)


def test_failure_before_the_listener_is_not_that_of_older_waits(sharing, node, listen):
    with sharing() as writer:
        writer.start_anew('a test says so')
        buffer = Buffer(shared=True)
        future = buffer.wait_for_transform_async('map', 'base', LATEST)
        listen(node, buffer)
        writer.set_transform(transform('map', 'base', 1.0, x=1.0), 'me')
        assert x_of(result_of(future)) == 1.0


def test_data_that_is_inserted_while_the_listener_waits_is_kept(sharing, node, pool):
    buffer = Buffer(shared=PATIENCE_S)
    asked = pool.submit(TransformListener, buffer, node)
    until(lambda: buffer.is_joining or not asked.running())
    buffer.set_transform_static(transform('map', 'mine'), 'me')
    with sharing(), asked.result(PATIENCE_S):
        assert not buffer.is_shared and buffer.can_transform('map', 'mine', LATEST)


def test_second_listener_waits_for_the_decision_of_the_first(sharing, node, pool, capfd):
    buffer = Buffer(shared=PATIENCE_S)
    first = pool.submit(TransformListener, buffer, node)
    until(lambda: buffer.is_joining or not first.running())
    second = pool.submit(TransformListener, buffer, node)
    with sharing(), first.result(PATIENCE_S) as one, second.result(PATIENCE_S) as other:
        assert one.joined and other.joined
    assert 'Traceback' not in capfd.readouterr().err


# --- what changes later

def test_writer_with_other_options_is_not_taken_for_the_one_before(sharing, node, listen):
    with sharing(cache_time=lasting(30.0)) as writer:
        writer.set_transform(transform('map', 'base'), 'me')
        buffer = listen(node, Buffer(lasting(20.0), shared=True))
        assert buffer.can_transform('map', 'base', LATEST)
    for options, reason in (
            ({'frame_prefix': 'r9/', 'cache_time': lasting(20.0)},
             "cannot be used here: it has frame_prefix='r9/', and this listener has ''"),
            ({'cache_time': lasting(1.0)},
             'cannot be used here: this buffer has to keep 20.000 s, and that keeps 1.000 s')):
        with sharing(**options) as writer:
            writer.set_transform(transform('map', 'base'), 'me')
            with pytest.raises(SharedTreeException, match=reason):
                buffer.lookup_transform('map', 'base', LATEST)
    with sharing(cache_time=lasting(30.0)) as writer:
        writer.set_transform(transform('map', 'base'), 'me')
        assert buffer.can_transform('map', 'base', LATEST)


def test_node_that_switches_its_clock_needs_a_writer_that_does(writer, node, listen):
    writer.set_transform(transform('map', 'base'), 'me')
    buffer = listen(node, Buffer(shared=True))
    assert buffer.can_transform('map', 'base', LATEST)
    node.set_parameters([Parameter('use_sim_time', value=True)])
    with pytest.raises(SharedTreeException, match='it has use_sim_time=False, and this listener'):
        buffer.lookup_transform('map', 'base', LATEST)
    writer.end_of_sharing.describe({**writer.end_of_sharing.reception, 'use_sim_time': True})
    assert buffer.can_transform('map', 'base', LATEST)


def test_lock_that_was_removed_and_made_again_is_found(sharing, context, node):
    place = Place(context.get_domain_id())
    with sharing():
        buffer = Buffer(node=node, shared=True)
        place.lock.unlink()
        place.memory.unlink()
        until(lambda: not buffer.can_transform('map', 'map', LATEST))
    with sharing() as writer:
        writer.set_transform(transform('map', 'base'), 'me')
        assert buffer.can_transform('map', 'base', LATEST)


def test_context_of_another_domain_is_another_place(writer, node, listen):
    other = Context()
    rclpy.init(context=other, args=[], domain_id=domains.claim())
    elsewhere = Node('elsewhere', context=other)
    assert not listen(elsewhere, Buffer(shared=0.01)).is_shared
    joined = listen(node, Buffer(shared=True))
    with pytest.raises(SharedTreeException, match='domain_id'):
        TransformListener(joined, elsewhere)
    other.try_shutdown()


def test_service_answers_while_there_is_no_writer(sharing, node):
    with sharing():
        buffer = Buffer(node=node, shared=True)
    answer = buffer.srv.callback(FrameGraph.Request(), FrameGraph.Response())
    assert answer.frame_yaml.startswith('# The process') and 'has ended' in answer.frame_yaml


def test_buffers_that_are_dropped_leave_nothing(writer, context, node):
    """The first one stays: rclpy keeps what was made last."""
    def descriptors():
        gc.collect()
        return [link for link in map(readlink, Path('/proc/self/fd').iterdir())
                if 'tf_tree_py' in link]

    before, threads = len(descriptors()), len(receivers())
    for number in range(5):
        short = Node(f'short_{number}', context=context)
        assert Buffer(node=short, shared=True).is_shared
        short.destroy_node()
        del short
    until(lambda: len(receivers()) == threads)
    until(lambda: len(descriptors()) <= before + 3)


def readlink(path):
    try:
        return os.readlink(path)
    except FileNotFoundError:
        return ''


def test_lookup_of_a_message_asks_again_when_its_memory_was_used(writer, node, monkeypatch):
    buffer, calls = Buffer(node=node, shared=True), []
    writer.set_transform(transform('map', 'base', x=1.0), 'me')

    def lapse_once(self, *arguments):
        calls.append(arguments)
        if len(calls) == 1:
            raise LapsedException('used again')
        return newest_pose(self, *arguments)

    newest_pose = PathFinder.newest_pose
    monkeypatch.setattr(PathFinder, 'newest_pose', lapse_once)
    assert x_of(buffer.lookup_transform('map', 'base', LATEST)) == 1.0
    assert len(calls) == 2
