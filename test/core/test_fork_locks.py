# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fork waits for the locks that other threads hold, and leaves all of them free."""

import subprocess
import sys

from programs import PATIENCE_S

BEGIN = """
import faulthandler, gc, os, signal, sys, threading, time, warnings
from tf_tree_py.core import fork_locks
warnings.simplefilter('ignore', DeprecationWarning)  # of a fork with threads
forking = threading.Event()
# Hooks before a fork run in the reverse order: this one is the first.
os.register_at_fork(before=forking.set)

def child(check):
    # Run a function in a child, and return whether it returned true there.
    process = os.fork()
    if not process:
        faulthandler.register(signal.SIGALRM, chain=True)
        signal.alarm(20)
        os._exit(not check())
    return os.waitpid(process, 0)[1] == 0

def is_free(lock):
    # An RLock may be taken again by the thread that holds it, so another thread tries.
    got = []

    def take():
        if lock.acquire(timeout=5):
            got.append(True)
            lock.release()

    thread = threading.Thread(target=take)
    thread.start()
    thread.join()
    return got == [True]

def all_free(locks):
    return all(is_free(lock) for lock in locks) and is_free(made_elsewhere())

def made_elsewhere():
    # Another thread has to be able to make a lock.
    made = []
    thread = threading.Thread(target=lambda: made.append(fork_locks.lock()), daemon=True)
    thread.start()
    thread.join(5)
    return made[0]
"""


def run(program):
    done = subprocess.run([sys.executable, '-c', BEGIN + program], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)
    assert (done.stdout, done.stderr) == ('done\n', '')


def test_lock_that_another_thread_holds_for_a_moment_is_free_in_the_child():
    run("""
locks = [fork_locks.lock(), fork_locks.rlock()]
assert list(map(type, locks)) == [type(threading.Lock()), type(threading.RLock())]
data = []
for _ in range(3):  # also in a child of a later fork
    held = threading.Event()
    forking.clear()

    def work():
        with locks[0], locks[1]:
            held.set()
            assert forking.wait(10)
            data.append(len(data))

    thread = threading.Thread(target=work)
    thread.start()
    held.wait()
    before = len(data)
    assert child(lambda: len(data) == before + 1 and all_free(locks))
    thread.join()
    # A child may fork, too.
    assert child(lambda: child(lambda: all_free(locks)) and all_free(locks))
    fresh = [fork_locks.lock(), fork_locks.rlock()]
    del fresh
for lock in locks:
    lock.acquire()
    lock.release()
assert all_free([fork_locks.lock()])
print('done')
""")


def test_threads_that_take_many_locks_in_any_order_do_not_block_a_fork():
    run("""
first = fork_locks.lock()
others = [fork_locks.lock() for _ in range(30)]
held = threading.Event()

def work():
    with first:
        held.set()
        assert forking.wait(10)
        # Until the fork has some of them; it has none if it waits for the first one first.
        patience = time.monotonic() + 1.0
        while not any(lock.locked() for lock in others) and time.monotonic() < patience:
            pass
        for lock in others:
            lock.acquire()
        for lock in others:
            lock.release()

thread = threading.Thread(target=work)
thread.start()
held.wait()
begin = time.monotonic()
assert child(lambda: all_free([first, *others]))
assert time.monotonic() - begin < 4.0, 'it gave up'
thread.join()
assert all_free([first, *others])
print('done')
""")


def test_objects_are_repaired_in_the_child_alone_with_all_locks_held():
    run("""
lock = fork_locks.lock()

class Thing:
    def __init__(self):
        self.repaired = []
        fork_locks.repair(self)

    def repair_in_child(self):
        self.repaired.append(lock.locked())

thing, gone = Thing(), Thing()
del gone
gc.collect()
assert child(lambda: thing.repaired == [True] and not lock.locked())
assert thing.repaired == []
print('done')
""")


def test_thread_that_forks_while_it_holds_a_lock_itself_goes_on():
    run("""
# Half a minute passes whenever the fork looks at the clock.
now = iter(range(0, 10**6, 30))
time.monotonic = lambda: next(now)
lock, other = fork_locks.lock(), fork_locks.lock()
with lock:
    assert child(lambda: is_free(other) and lock.locked() and is_free(made_elsewhere()))
    assert lock.locked() and is_free(other)
assert child(lambda: all_free([lock, other]))
print('done')
""")
