# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Child processes of os.fork() while threads use a buffer."""

import subprocess
import sys

from hypothesis import settings
from programs import PATIENCE_S

# A child that hangs is killed by its alarm, after it has printed its stack.
PROGRAM = """
import faulthandler, os, signal, sys, threading
from tf_tree_py import BufferCore, Pose, TransformException
from tf_tree_py.health.doctor import Doctor

FORKS = int(sys.argv[1])
buffer = BufferCore(cache_time=10**9)
doctor = Doctor()
buffer.observers.add(doctor)
ended = threading.Event()
begun = threading.Barrier(5)

def write(child):
    stamp = 0
    begun.wait()
    while not ended.is_set():
        stamp += 10**7  # so the buffer keeps a hundred samples
        buffer.insert('map', child, stamp, Pose(x=float(stamp)))
        buffer.snapshot()

def wait_in_vain():
    begun.wait()
    while not ended.is_set():
        try:
            buffer.lookup_within(0.001, 'map', 'never')
        except TransformException:
            pass
        doctor.findings()

def in_child():
    faulthandler.register(signal.SIGALRM, chain=True)
    signal.alarm(20)
    for child in ('a', 'b'):
        for stamp in buffer.stamps_of(child)[-50:].tolist():
            assert buffer.lookup('map', child, stamp).x == stamp, 'half a sample'
    threading.Timer(0.0, buffer.insert, ('map', 'never', 1, Pose(x=2.0))).start()
    assert buffer.lookup_within(15.0, 'map', 'never').x == 2.0
    assert not len(buffer.waiting)
    assert buffer.snapshot().frames() == buffer.frames()
    doctor.findings()

threads = [threading.Thread(target=write, args=(child,)) for child in 'ab']
threads += [threading.Thread(target=wait_in_vain) for _ in range(2)]
for thread in threads:
    thread.start()
begun.wait()
while len(buffer.frames()) < 3:
    pass
statuses = []
for _ in range(FORKS):
    process = os.fork()
    if not process:
        try:
            in_child()
        except BaseException:
            import traceback
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    statuses.append(os.waitpid(process, 0)[1])
    if statuses[-1]:
        break
ended.set()
for thread in threads:
    thread.join()
print(statuses[-1], len(statuses))
"""


def test_child_of_a_busy_process_has_a_whole_buffer_and_free_locks():
    forks = 150 if settings().max_examples >= 20 else 50
    done = subprocess.run([sys.executable, '-W', 'ignore', '-c', PROGRAM, str(forks)],
                          capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.stdout.split() == ['0', str(forks)], done.stdout + done.stderr
