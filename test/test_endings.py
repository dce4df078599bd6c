# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Several signals in a row, and signals while a program ends: an impatient user's Ctrl-C."""

import sys

from programs import completed
import pytest

START = """
import os, signal, sys
from tf_tree_py.command import endings, signals

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(100):  # Python handles a signal at the next jump or call
        pass

def tidily(_):
    signals.raise_interrupts()
    try:
        interrupt()
    finally:
        interrupt()
        print('tidy')
"""


def run(program):
    """Run a program; return its exit status and its output."""
    done = completed(sys.executable, '-c', START + program)
    return done.returncode, done.stdout + done.stderr


def test_second_signal_at_once_does_not_interrupt_the_clean_up():
    assert run("sys.exit(endings.run('tool', tidily))") == (130, 'tidy\n')


def test_later_signal_interrupts_a_clean_up_that_hangs():
    assert run("signals._PAUSE_S = 0.0; sys.exit(endings.run('tool', tidily))") == (130, '')


@pytest.mark.parametrize('work', ['lambda _: signals.raise_interrupts() or 3', 'tidily'])
def test_signal_at_the_very_end_has_no_effect(work):
    """The last function that a program calls is interrupted at its start."""
    status, output = run(f"""
signals._PAUSE_S, ignore = 0.0, signals.ignore

def interrupted():
    interrupt()
    ignore()
    print('ended')

signals.ignore = interrupted
sys.exit(endings.run('tool', {work}))
""")
    assert (status, output) == (130 if work == 'tidily' else 3, 'ended\n')


def test_first_signal_waits_for_the_end_of_a_block_that_must_not_be_halved():
    assert run("""
def work(_):
    signals.raise_interrupts()
    try:
        with signals.deferred():
            interrupt()
            print('whole')
        print('continued')
    finally:
        with signals.deferred():  # nothing is deferred here
            print('clean-up')
        print('the end')

sys.exit(endings.run('tool', work))
""") == (130, 'whole\nclean-up\nthe end\n')


@pytest.mark.parametrize(('inside', 'after'), [('pass', 'interrupt()'), ('interrupt()', 'pass')])
def test_signal_in_such_a_block_that_fails_or_after_it_is_not_lost(inside, after):
    assert run(f"""
def work(_):
    signals.raise_interrupts()
    try:
        with signals.deferred():
            {inside}
            raise ValueError
    except ValueError:
        pass
    {after}
    print('continued')

sys.exit(endings.run('tool', work))
""") == (130, '')


def test_later_signal_interrupts_such_a_block_that_hangs():
    assert run("""
def work(_):
    signals._PAUSE_S = 0.0
    signals.raise_interrupts()
    with signals.deferred():
        interrupt()
        print('whole')
        interrupt()
        print('continued')

sys.exit(endings.run('tool', work))
""") == (130, 'whole\n')
