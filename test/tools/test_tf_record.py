# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_record on bags: it extracts the time around findings."""

import json
import os
import resource
import signal
import sys
import threading

from bags import write_ros2
from conditions import until
from hand_clock import HandClock
from patients import FAULTY, HEALTHY
from programs import completed, PATIENCE_S
import pytest
from tf_tree_py.tools import tf_record
from tool_helpers import assert_one_sentence, assert_shape, command, tool


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('record')
    return {name: write_ros2(folder / name, sorted(messages, key=lambda each: each.received))
            for name, messages in (('well', HEALTHY['warehouse_robot']()),
                                   ('loop', FAULTY['loop']), ('gap', FAULTY['gap']))}


def test_what_is_cut_out_shows_the_same_finding_to_the_doctor(bags, tmp_path):
    done = tool('tf_record', '--bag', bags['loop'], '--on', 'loop,gap', '-o', tmp_path, '--json')
    assert done.returncode == 1
    line = json.loads(done.stdout)
    assert_shape(line, 'tools', '### A line of tf_record')
    assert (line['why'], line['frames']) == ('loop', ['tool', 'base_link'])
    findings = json.loads(tool('tf_doctor', '--bag', line['bag'], '--json').stdout)['findings']
    assert [finding['code'] for finding in findings] == ['loop']


def test_healthy_recording_gives_its_last_seconds(bags, tmp_path):
    done = tool('tf_record', '--bag', bags['well'], '--last', '2', '-o', tmp_path)
    assert done.returncode == 0
    bag, = tmp_path.glob('*.mcap')
    assert done.stdout == f'{bag}: asked: the end of the recording\n'
    watched = json.loads(tool('tf_doctor', '--bag', bag, '--json').stdout)
    assert watched['watched_s'] == pytest.approx(2.0, abs=0.1)
    on = tool('tf_record', '--bag', bags['well'], '--on', 'loop', '-o', tmp_path / 'none')
    assert (on.returncode, on.stdout) == (0, '')


def test_lookup_that_is_lost_is_recorded(bags, tmp_path):
    done = tool('tf_record', '--bag', bags['gap'], '--on', 'lookup_failed', '--lookup', 'map',
                'lidar', '-o', tmp_path)
    assert done.returncode == 1
    assert 'lookup_failed: Lookup would require extrapolation' in done.stdout


@pytest.mark.parametrize('arguments, sentence', [
    (['--on', 'loops'], "'loops' is neither lookup_failed nor a code"),
    (['--on', 'lookup_failed'], 'must be used together'),
    (['--lookup', 'map', 'base'], 'must be used together'),
    (['-o', __file__], 'cannot hold bags: File exists'),
    (['--keep', '-1'], "'-1' is not a number")])
def test_wrong_arguments_are_one_sentence(arguments, sentence):
    assert_one_sentence(tool('tf_record', *arguments), 'tf_record', sentence)


def on_full_disk(name, *arguments):
    """
    Run a tool with a limit of a few bytes for each file.

    Python would store truncated bytecode of what the tool is the first to import, and every later
    import of it would fail.
    """
    return completed(*command(name), *map(str, arguments),
                     env={**os.environ, 'PYTHONDONTWRITEBYTECODE': '1'},
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)))


def test_bag_that_cannot_be_written_is_no_success(bags, tmp_path):
    done = on_full_disk('tf_record', '--bag', bags['well'], '-o', tmp_path)
    assert done.returncode == 2
    assert done.stdout.startswith('not written, ')
    assert [*tmp_path.iterdir()] == []


def test_picture_that_cannot_be_written_leaves_the_old_one(bags, tmp_path):
    picture = tmp_path / 'frames.dot'
    picture.write_text('what was there')
    done = on_full_disk('tf_frames', '--bag', bags['well'], '-o', picture)
    assert (done.returncode, done.stderr) == (2, f'tf_frames: {picture}: File too large\n')
    assert [*tmp_path.iterdir()] == [picture]
    assert picture.read_text() == 'what was there'


def test_a_flood_of_requests_is_one_a_second_with_their_number(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(tf_record, 'time', clock)
    before = signal.getsignal(signal.SIGUSR1), signal.getsignal(signal.SIGTTIN)
    read_end, write_end = os.pipe()
    try:
        with os.fdopen(read_end) as screen, os.fdopen(write_end, 'w') as keyboard:
            monkeypatch.setattr(sys, 'stdin', screen)
            requests = tf_record.DumpRequests()
            (reader,) = [each for each in threading.enumerate() if each.name == 'Enter']
            for _ in range(1000):
                signal.raise_signal(requests.SIGNAL)
            assert requests.pop() == ['SIGUSR1, 1000 times']
            signal.raise_signal(requests.SIGNAL)
            print(file=keyboard, flush=True)
            until(lambda: requests.pop() == ['Enter'])
            clock.now += 1.0
            signal.raise_signal(requests.SIGNAL)
            assert requests.pop() == ['SIGUSR1, 2 times'] and requests.pop() == []
            keyboard.close()
            reader.join(PATIENCE_S)
    finally:
        for number, handler in zip((signal.SIGUSR1, signal.SIGTTIN), before, strict=True):
            signal.signal(number, handler)


def test_ctrl_c_as_a_line_is_printed_does_not_lose_it():
    """The record of the bag has left the queue by then."""
    done = completed(sys.executable, '-c', """
from pathlib import Path
from queue import SimpleQueue
import signal
from tf_tree_py.command import signals
from tf_tree_py.recording.flight_recorder import Happened
from tf_tree_py.tools.tf_record import _StatusLine

class Interrupting(SimpleQueue):
    def get(self):
        taken = super().get()
        signal.raise_signal(signal.SIGINT)
        return taken

status_line = _StatusLine(as_json=False)
status_line._dumps = Interrupting()
signals.raise_interrupts()
status_line.note(Happened('asked', 'asked'), Path('a.mcap'), '')
try:
    status_line.print_all()
except KeyboardInterrupt:
    print('interrupted')
""")
    assert done.stdout == 'a.mcap: asked: asked\ninterrupted\n', done.stderr
