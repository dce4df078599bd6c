# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which executors may be woken from another thread."""

import pytest
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from tf_tree_py.ros.threads import executors


@pytest.mark.parametrize('of_type', [SingleThreadedExecutor, MultiThreadedExecutor])
def test_executors_of_rclpy_may_be_called(context, of_type):
    executor = of_type(context=context)
    assert executors.takes_calls(executor)
    executor.shutdown()


@pytest.mark.parametrize(('code', 'may'), [
    (b'..events_executor..pthread_cond_timedwait..', False),
    (b'..events_executor..pthread_cond_timedwait..pthread_cond_clockwait..', True),
    (b'..events_executor..asio..', True)], ids=['wheels', 'new glibc', 'other queue'])
def test_events_executor_may_be_called_if_its_queue_can_wait(
        context, tmp_path, monkeypatch, capfd, code, may):
    experimental = pytest.importorskip('rclpy.experimental')
    (tmp_path / 'rclpy.so').write_bytes(code)
    monkeypatch.setattr(executors.rclpy_implementation, '__file__', str(tmp_path / 'rclpy.so'))
    executors.has_broken_queue.cache_clear()
    executor = experimental.EventsExecutor(context=context)
    assert [executors.takes_calls(executor) for _ in range(2)] == [may, may]
    assert capfd.readouterr().err.count('delivers nothing if it spins without a timeout') == (
        not may)
    executor.shutdown()
    executors.has_broken_queue.cache_clear()
