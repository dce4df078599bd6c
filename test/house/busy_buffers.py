# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Program: use every lock of buffers without ROS; print in which order they are taken."""

import gc
import os
import pickle
import tempfile
import threading
import warnings

import lock_order

lock_order.record()  # before the package makes any lock

from programs import PATIENCE_S  # noqa: E402
from tf_tree_py import BufferCore, Pose, TransformException  # noqa: E402
from tf_tree_py.core.buffer.waiting import WallDeadline  # noqa: E402
from tf_tree_py.core.messages.observers import ReceivedMessage  # noqa: E402
from tf_tree_py.core.messages.sample import Sample  # noqa: E402
from tf_tree_py.core.messages.wire import read, write  # noqa: E402
from tf_tree_py.health.doctor import Doctor  # noqa: E402
from tf_tree_py.limited_log import LimitedLog  # noqa: E402
from tf_tree_py.recording.flight_recorder import FlightRecorder, Happened  # noqa: E402
from tf_tree_py.reports.audit import LookupAudit  # noqa: E402
from tf_tree_py.thinning import MovingSender, StaticSender, Thinner  # noqa: E402
from tf_tree_py.tools.missing import Refusals  # noqa: E402
from tf_tree_py.view.model.playhead import IncidentLog as IncidentTimes  # noqa: E402


def observed(folder):
    """Return a buffer with every observer of the package, and the flight recorder among them."""
    buffer = BufferCore(now=lambda: 10**10)
    recorder = FlightRecorder(folder, notify=lambda *_: buffer.frames())
    for observer in (Doctor(), recorder, LookupAudit(buffer), Refusals(recorded=False),
                     IncidentTimes()):
        buffer.observers.add(observer)
    return buffer, recorder


def be_busy(buffer):
    """Insert, refuse, look up, copy and wait, each in its own way."""
    for second in (1, 2, 3):
        buffer.insert('map', 'base', second * 10**9, Pose(x=1.0))
        for source in ('wheels', 'lidar'):
            buffer.insert_from(source, 'base', 'wheel', second * 10**9, Pose(y=1.0))
    buffer.switch('wheel', 'lidar')
    batch = read(write([Sample('base', 'arm', 10**9, Pose(z=1.0))]))
    buffer.observers.notify_received(ReceivedMessage(batch, 10**10, '/tf'))
    buffer.insert_batch(batch, 'robot', announced=True)
    for bad in (('base', 'map'), ('base', 'base')):  # a loop, and a self edge
        buffer.insert(*bad, 2 * 10**9, Pose(), strict=False)
    for stamp in (10**12, 10**9):  # far in the future, and too old after that
        buffer.insert('map', 'ahead', stamp, Pose(), strict=False)
    buffer.lookup('map', 'wheel', 2 * 10**9)
    buffer.lookup_many('map', 'base', [10**9, 2 * 10**9])
    # Here the query, and so its observers, run with the lock held.
    buffer.wait_for(lambda: buffer.lookup('map', 'base', 10**9), WallDeadline(PATIENCE_S))
    buffer.correct('base', Pose(x=0.1), 3 * 10**9)
    pickle.loads(pickle.dumps(buffer.snapshot())).frames()
    buffer.smoothed().frames()


def wait(buffer):
    """Let threads wait for data that others insert, and for a failure."""
    names = [f'late{number}' for number in range(4)]
    waiters = [threading.Thread(target=buffer.lookup_within, args=(PATIENCE_S, 'map', name))
               for name in names]
    writers = [threading.Thread(target=buffer.insert, args=('map', name, 10**9, Pose()))
               for name in names]
    for thread in (*waiters, *writers):
        thread.start()
    for thread in (*waiters, *writers):
        thread.join(PATIENCE_S)
        assert not thread.is_alive(), 'a deadlock'
    try:
        buffer.lookup_within(0.001, 'map', 'never')
    except TransformException:
        buffer.start_anew('the test says so')


def log_and_send(buffer):
    """Use what is written and sent."""
    log = LimitedLog(lambda _: buffer.frames())
    log.write('kind', 'sender', lambda: 'text')
    log.write_counts()
    moving = MovingSender(lambda _: None, Thinner())
    moving.offer([Sample('map', 'base', 10**9, Pose())])
    moving.close()
    StaticSender(lambda _: None).offer([Sample('map', 'base', 0, Pose())])


def fork(buffer):
    """Let a child use the buffer, too."""
    child = os.fork()
    if not child:
        status = 1
        try:
            buffer.insert('map', 'base', 10**10, Pose())
            buffer.snapshot()
            status = 0
        finally:
            os._exit(status)
    assert os.waitpid(child, 0)[1] == 0


def main():
    warnings.simplefilter('ignore')
    with tempfile.TemporaryDirectory() as folder:
        buffer, recorder = observed(folder)
        be_busy(buffer)
        wait(buffer)
        log_and_send(buffer)
        for _ in range(2):  # the second is refused: too soon
            recorder.write(Happened('test', 'summary', 0))
        recorder.close()
        fork(buffer)
        del buffer, recorder
        gc.collect()
    lock_order.print_pairs()


if __name__ == '__main__':
    main()
