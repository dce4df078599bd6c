# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A process with a listener ends like one without: at once and quietly."""

import contextlib
import itertools
from pathlib import Path
import signal
import subprocess
import sys
import textwrap
import threading

from domains import claim
import pytest
import rclpy
from ros_helpers import (
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
    WAITED,
)
from tf_tree_py import Buffer, LookupException, TransformBroadcaster, TransformListener

BEGIN = """
    import sys
    import threading

    import rclpy
    from rclpy.duration import Duration
    from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.parameter import Parameter
    from rclpy.time import Time
    from tf_tree_py import Buffer, TransformException, TransformListener

    HOUR = Duration(seconds=3600)
    RCLError = rclpy_implementation.RCLError

    # A signal between two waits of an executor makes rclpy raise RCLError, with or without us.
    ENDED = (KeyboardInterrupt, ExternalShutdownException, RCLError)

    def ready():
        print('ready', flush=True)

    def wait_for_ever():
        try:
            buffer.lookup_transform('a', 'b', Time(), HOUR)
        except TransformException as error:
            print(type(error).__name__, error, flush=True)

    def until_waiting():
        while not len(buffer.waiting):
            threading.Event().wait(0.001)

    rclpy.init()
    node = rclpy.create_node('ending')
    buffer = Buffer(node=node)
"""
LISTEN = 'listener = TransformListener(buffer, node)'


def run(code, send=None, listen=LISTEN):
    """Run a program; return its exit code and outputs."""
    program = textwrap.dedent(BEGIN) + listen + '\n' + textwrap.dedent(code)
    return outcome([sys.executable, '-X', 'faulthandler', '-c', program], send)


def outcome(command, send=None):
    """Run a process, send it a signal when it is ready; return its exit code and outputs."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        first = process.stdout.readline()
        if send is not None and first:
            process.send_signal(send)
        out, err = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    return process.returncode, first + out, err


def assert_ended(result, *said, codes=(0,)):
    """Check the exit code, and the output; rclpy itself may complain of an untimely signal."""
    code, out, err = result
    assert code in codes
    assert 'tf_tree_py' not in err
    assert 'receiver' not in err
    for words in said:
        assert words in out


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_a_spinning_node_and_the_lookups_of_its_threads(pool, number):
    """They would keep the process alive for an hour, or forever while /clock stands still."""
    for result in pool.map(lambda simulated: run(f"""
        node.set_parameters([Parameter('use_sim_time', value={simulated})])
        threading.Thread(target=wait_for_ever).start()
        until_waiting()
        # Without a timeout, rclpy alone sometimes misses the end of its context, and spins on.
        rclpy.get_global_executor().create_task(ready)
        try:
            while rclpy.ok():
                rclpy.spin_once(node, timeout_sec=1.0)
        except ENDED:
            pass
        for thread in threading.enumerate():
            if thread is not threading.main_thread():
                thread.join()
        print('the receiver ended though nobody closed it')
        node.destroy_node()
        rclpy.try_shutdown()
    """, number), [True, False]):
        assert_ended(result, 'LookupException', 'the receiver ended',
                     'Given up: the listener was closed, or ROS was shut down')


def test_ctrl_c_that_nobody_catches_looks_as_without_a_listener(pool):
    spin = """
        ready()
        rclpy.spin(node)
    """
    for result in pool.map(lambda listen: run(spin, signal.SIGINT, listen), [LISTEN, '']):
        # KeyboardInterrupt, or rclpy was between two waits.
        assert_ended(result, codes=(-signal.SIGINT, 1))
        assert 'Traceback' in result[2]


def test_ctrl_c_interrupts_a_lookup_of_the_main_thread():
    code, out, err = run("""
        threading.Thread(target=lambda: (until_waiting(), ready()), daemon=True).start()
        try:
            wait_for_ever()
        except KeyboardInterrupt:
            print('interrupted')
    """, signal.SIGINT)
    assert (code, err) == (0, '')
    assert 'interrupted' in out


def test_ctrl_c_ends_a_callback_of_a_multi_threaded_executor_that_waits():
    # The signal is sent after the pool has recorded its thread. If KeyboardInterrupt keeps
    # ThreadPoolExecutor from recording a thread, the process waits for that thread forever.
    assert_ended(run("""
        executor = MultiThreadedExecutor()
        executor.add_node(node)
        executor.create_task(wait_for_ever)
        executor.spin_once()
        until_waiting()
        try:
            ready()
            executor.spin()
        except ENDED:
            print('interrupted')
    """, signal.SIGINT), 'interrupted', 'Given up')


POURING = """
    from geometry_msgs.msg import TransformStamped
    from tf_tree_py import TransformBroadcaster

    broadcaster = TransformBroadcaster(node)
    message = TransformStamped(child_frame_id='b')
    message.header.frame_id = 'a'

    def pour():
        while True:
            message.header.stamp.nanosec += 1
            broadcaster.sendTransform(message)

    for _ in range(3):
        TransformListener(buffer, node)
    threading.Thread(target=pour, daemon=True).start()
    buffer.lookup_transform('a', 'b', Time(), HOUR)
    ready()
"""


def test_process_that_just_ends_does_so_quietly(pool):
    """Also while messages pour in."""
    ends = ['', 'rclpy.shutdown()', 'node.destroy_node(); rclpy.shutdown(); listener.close()',
            'sys.exit(0)', 'del node, listener, buffer']
    programs = [POURING, *(f'ready()\n{end}' for end in ends)]
    for program, result in zip(programs, pool.map(run, programs), strict=True):
        assert (program, *result) == (program, 0, 'ready\n', '')


def test_exception_of_the_program_is_the_one_that_is_shown():
    code, _, err = run("""
        ready()
        raise ValueError('of the program')
    """)
    assert code == 1
    assert err.count('Traceback') == 1
    assert err.strip().splitlines()[-1] == 'ValueError: of the program'


# --- in this process


@pytest.mark.parametrize('options', [{}, SIM_TIME], ids=['wall time', 'simulated time'])
@pytest.mark.parametrize('ends', ['listener', 'context'])
def test_end_of_the_last_listener_ends_the_waits(
        context, make_node, sim_clock, pool, capfd, monkeypatch, options, ends):
    """Also those that wait for a clock that will never tick."""
    node, other = make_node('node', **options), make_node('other', **options)
    # The node's own clock would outlive the listener, and stand still.
    buffer = Buffer(node=node if ends == 'context' else None)
    first, second = TransformListener(buffer, node), TransformListener(buffer, other)
    if options:
        sim_clock.show(10.0, buffer)
    asked = [pool.submit(buffer.lookup_transform, 'a', 'b', LATEST, PATIENCE)]
    asked += [buffer.wait_for_transform_async('a', 'b', LATEST, timeout)
              for timeout in (None, PATIENCE)]
    unread = buffer.wait_for_transform_async('a', 'b', LATEST)
    until_waiting(buffer, 4)
    first.close()
    asked.append(pool.submit(buffer.lookup_transform, 'a', 'c', LATEST, PATIENCE))
    until_waiting(buffer, 5)
    assert not any(future.done() for future in asked)
    # A waiting thread may run as soon as the clock of the listener leaves.
    watch = buffer.timeouts.watch
    leave = watch.leave
    monkeypatch.setattr(watch, 'leave', lambda *clock: (leave(*clock), until(asked[0].done)))
    if ends == 'context':
        context.shutdown()
    else:
        second.close()
    for future in asked:
        with pytest.raises(LookupException, match='Given up: the listener was closed, or ROS was'
                           ) as raised:
            result_of(future)
        assert raised.value.waited_s < PATIENCE_S
    until(unread.done)
    del unread
    # A wait that begins now is an ordinary one.
    with pytest.raises(LookupException, match=WAITED + r'\.\nNothing has been'):
        buffer.lookup_transform('a', 'b', LATEST, lasting(0.01))
    later = [pool.submit(buffer.lookup_transform, 'a', 'b', LATEST, PATIENCE),
             buffer.wait_for_transform_async('a', 'b', LATEST)]
    until_waiting(buffer, 2)
    buffer.set_transform(transform('a', 'b'), 'me')
    for future in later:
        result_of(future)
    second.close()
    assert 'never retrieved' not in capfd.readouterr().err


def test_contexts_that_end_while_messages_pour_in(node, listen, talker, capfd):
    """The receiver may be between any two calls of rclpy when its context ends."""
    beside = listen(node)

    def pour(broadcaster):
        with contextlib.suppress(Exception):  # they also end with the context
            for second in itertools.count(1):
                broadcaster.sendTransform(transform('map', 'base', second))

    def has_ended():
        return len(receivers()) == 1

    # In a domain of their own: Fast DDS may never end a participant that has just discovered
    # another one (docs/ending.md).
    alone = claim()
    for _ in range(20):
        context = rclpy.Context()
        rclpy.init(context=context, args=[], domain_id=alone)
        node = rclpy.create_node('short', context=context)
        buffer = Buffer()
        TransformListener(buffer, node)
        pouring = threading.Thread(target=pour, args=(TransformBroadcaster(node),))
        pouring.start()
        buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
        context.shutdown()
        pouring.join(PATIENCE_S)
        node.destroy_node()
        until(has_ended)
    # Another context goes on.
    talker.move(transform('map', 'camera'), into=beside)
    err = capfd.readouterr().err
    assert 'Traceback' not in err
    assert 'failed' not in err


def test_example_of_a_quiet_end(pool):
    example = Path(__file__).parents[2] / 'examples' / 'quiet_end.py'
    for code, _, err in pool.map(lambda number: outcome([sys.executable, example], number),
                                 [signal.SIGINT, signal.SIGTERM]):
        assert (code, err) == (0, '')
