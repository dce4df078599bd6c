# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The labs over DDS, shortened: real processes, and a clean end."""

from concurrent.futures import CancelledError
import gc
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading

from programs import completed, PATIENCE_S
import pytest
from tf_tree_py.core import LookupException
from tf_tree_py.labs.live import (
    live_anchor,
    live_cycle,
    live_latency,
    live_one_edge,
    live_remount,
    live_session,
    live_startup,
    live_static_spam,
)
from tf_tree_py.labs.startup import measure


@pytest.fixture(autouse=True)
def nothing_is_left():
    before = _ros_variables()
    yield
    assert multiprocessing.active_children() == []
    assert not [thread for thread in threading.enumerate() if 'receiver' in thread.name]
    assert _ros_variables() == before


def _ros_variables():
    return {name: value for name, value in os.environ.items() if name.startswith('ROS_')}


def test_anchor_as_a_node_never_jumps():
    numbers = live_anchor.run(seconds=5.0).numbers
    assert numbers['anchored_m'] < 0.05
    # It rotates about the robot's position at a pose's stamp; the robot has moved since.
    assert numbers['step_m'] < numbers['own_step_m'] + 1.5 * numbers['rate_m']


def test_latency_between_two_processes():
    numbers = live_latency.run(images=8).numbers
    # On a busy machine the ages of the latest vary, and with them the fitted slopes. But each
    # error is exactly the speed times the time from the image to the stamp of the latest.
    assert numbers['worst_beside_law_m'] < 1e-6
    assert numbers['worst_stamped_m'] < 1e-4
    assert numbers['now_raised'] > 0.9 * numbers['now_asked']
    assert 0.0 < numbers['transport_median_s'] <= numbers['transport_worst_s']


def test_slope_is_the_speed_if_the_latest_is_always_of_the_same_age():
    ms = 1_000_000
    looks = [live_latency.LookupErrors(
        0.5, delay, delay, delay - 5 * ms, 0.5 * (delay - 5 * ms) / 1e9, 0.0, True)
        for delay in (0, 20 * ms, 100 * ms)]
    assert live_latency.fit(looks, 0.5) == pytest.approx((0.5, 0.005))


def test_remounted_camera_reaches_every_module_that_uses_it():
    report = live_remount.run(processes=2)
    assert (report.numbers['changed'], report.numbers['unchanged']) == (5, 7)
    for row in report.tables[0].as_dict()['rows']:
        assert (row['after_s'] is not None) == (row['sensor'] == 'head_camera')
        assert (row['moved_m'] > 0.05) == (row['sensor'] == 'head_camera')


def test_edited_line_reaches_every_module_that_looks_over_its_edge():
    report = live_one_edge.run(processes=2)
    assert (report.numbers['changed'], report.numbers['unchanged']) == (7, 5)
    above = {'head_camera', 'chest_camera', 'lidar'}
    for row in report.tables[0].as_dict()['rows']:
        over = row['sensor'] in above and row['target'] not in ('torso', 'right_hand')
        assert (row['after_s'] is not None) == over == (row['turned_rad'] > 0.01)


def test_startup_before_the_publisher():
    numbers = live_startup.run(starts=3).numbers
    assert numbers['first_failed']['0.0'] == numbers['starts'] == 3
    assert 0.0 < numbers['came_median_s'] <= numbers['came_worst_s']


def test_static_edge_is_sent_once_and_the_end_of_a_spammer_is_noticed():
    numbers = live_static_spam.run(seconds=0.5).numbers
    # How many arrive in this time, and what they cost, depends on how busy the machine is.
    assert numbers['spam_sent_per_s'] > 0.0 and numbers['static_transforms_per_s'] == 0.0
    dead, fixed = numbers['after'].values()
    assert dead.startswith('FutureExtrapolationException') and fixed == 'answers'


def test_loop_is_refused_when_it_arrives():
    numbers = live_cycle.run(seconds=0.3).numbers
    assert numbers['refused'] > 0 and numbers['errors'] == 0
    assert numbers['different_answers'] == 20
    assert 'would close a loop' in numbers['incident']


def silent(_, pipe):
    """Send nothing, and end with the pipe."""
    pipe.recv()


def gone(_, pipe):
    """End at once."""


def test_process_that_is_gone_or_silent_is_told(monkeypatch):
    monkeypatch.setattr(live_session, 'PATIENCE_S', 0.1)
    with live_session.session() as lab:
        pipe = lab.start(silent)
        with pytest.raises(RuntimeError, match='sent nothing'):
            live_session.answer(pipe)
        monkeypatch.setattr(live_session, 'PATIENCE_S', 20.0)
        with pytest.raises(RuntimeError, match='ended prematurely'):
            live_session.answer(lab.start(gone))


def assert_nothing_but_progress(err):
    """Assert that there is no output except the progress lines of a slow machine."""
    assert not [line for line in err.splitlines() if ' s so far, Ctrl-C ends it' not in line]


def test_ctrl_c_ends_all_processes_without_a_word():
    command = [sys.executable, '-c', _STUCK]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          start_new_session=True) as process:
        pid = json.loads(process.stdout.readline())
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (130, '')
    assert_nothing_but_progress(err)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


# A lab that waits forever for its other process; it prints when it starts to wait.
_STUCK = """
import sys
from tf_tree_py.labs import catalogue
from tf_tree_py.labs.live import live_latency, live_session, live_startup
from tf_tree_py.labs.tf_lab import main

def run():
    with live_session.session() as lab:
        pipe = lab.start(live_startup.publish)
        live_session.answer(pipe)
        print(lab._processes[0][0].pid, flush=True)
        live_session.answer(pipe)

live_latency.run = run
sys.exit(main(['tf_lab', 'latency', '--ros']))
"""


# Ctrl-C goes to all processes of the terminal: here just before and after each one is started.
_PRESSED = """
import os, signal, sys
from multiprocessing.context import ForkServerProcess

start = ForkServerProcess._Popen

def press_and_start(process):
    os.killpg(0, signal.SIGINT)
    started = start(process)
    os.killpg(0, signal.SIGINT)
    return started

ForkServerProcess._Popen = staticmethod(press_and_start)
signal.signal(signal.SIGINT, signal.default_int_handler)
from tf_tree_py.labs.tf_lab import main
sys.exit(main(['tf_lab', sys.argv[1], '--ros']))
"""


@pytest.mark.parametrize('name', ['latency', 'startup', 'cycle', 'remount', 'static-spam'])
def test_ctrl_c_while_a_lab_starts_ends_it(name):
    done = completed(sys.executable, '-c', _PRESSED, name, start_new_session=True)
    assert (done.returncode, done.stdout) == (130, '')
    assert_nothing_but_progress(done.stderr)


@pytest.fixture
def ctrl_c_is_heard():
    """Restore SIGINT, which a shell makes background processes ignore."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    gc.disable()  # hypothesis runs in every collection, where an exception is lost
    yield
    gc.enable()
    signal.signal(signal.SIGINT, handler)


def test_threads_of_a_startup_end_with_ctrl_c(ctrl_c_is_heard):
    def ask(timeout_s):
        raise LookupException('not there yet')

    def begin():
        # To the process, as from a terminal: a signal to this thread would not wake the main one.
        os.kill(os.getpid(), signal.SIGINT)

    before = set(threading.enumerate())
    with pytest.raises((KeyboardInterrupt, CancelledError)):
        measure(ask, begin)
    for thread in set(threading.enumerate()) - before:
        thread.join(PATIENCE_S)
        assert not thread.is_alive()
