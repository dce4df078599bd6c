# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure the load of many clients on a server.

Run ``python -m benchmark.clients``, after ``. scripts/env``. It starts the server and processes
with clients, each with its own connection. All clients wait for one transform, which is then
published. Afterwards one client looks up in a loop.
"""

import argparse
from pathlib import Path
import statistics
import subprocess
import sys
import threading
import time

from geometry_msgs.msg import TransformStamped
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py import BufferClient, TransformBroadcaster

ACTION = 'tf2_buffer_server'
PATIENCE = Duration(seconds=120.0)
WAIT_S = 5.0


def main() -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--processes', type=int, default=20)
    parser.add_argument('--clients', type=int, default=5, help='in each process')
    parser.add_argument('--asking', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    rclpy.init()
    if options.asking:
        ask(options.clients)
    else:
        measure(options.processes, options.clients)
    rclpy.try_shutdown()


def ask(count: int) -> None:
    """Make a number of clients wait; print the times of their responses."""
    node = rclpy.create_node('asking')
    clients = [BufferClient(node, ACTION) for _ in range(count)]
    assert all(client.wait_for_server(PATIENCE) for client in clients)
    print('ready', flush=True)
    sys.stdin.readline()
    answered: list[float] = []
    all_answered = threading.Event()

    def note(_: object) -> None:
        answered.append(time.monotonic())
        if len(answered) == count:
            all_answered.set()

    calls = [client.wait_for_transform_async('map', 'base', Time(), PATIENCE)
             for client in clients]
    for call in calls:
        call.add_done_callback(note)
    assert all_answered.wait(150.0)
    assert all(call.exception() is None for call in calls)
    print(*answered, flush=True)
    sys.stdin.readline()
    for client in clients:
        client.close()


def measure(processes: int, count: int) -> None:
    """Start all processes, and publish the transform for which all clients wait."""
    server = start('tf_tree_py.nodes.buffer_server')
    home = Path(f'/proc/{server.pid}')
    asking = [start('benchmark.clients', '--asking', '--clients', str(count))
              for _ in range(processes)]
    for process in asking:
        assert process.stdout and process.stdout.readline() == 'ready\n'
    node = rclpy.create_node('publishing')
    broadcaster = TransformBroadcaster(node)
    while broadcaster.pub_tf.get_subscription_count() < 1:
        time.sleep(0.01)
    idle = cpu_s(home)
    resume(asking)
    time.sleep(WAIT_S)
    asked = cpu_s(home)
    time.sleep(WAIT_S)
    waited = cpu_s(home)
    begin = time.monotonic()
    broadcaster.sendTransform(a_transform())
    lines = [process.stdout.readline().split() for process in asking if process.stdout]
    latencies = [(float(text) - begin) * 1e3 for line in lines for text in line]
    answered = cpu_s(home)
    print(f'{processes} processes with {count} clients each, all waiting for one transform')
    print(f'  from its publication to the result: median {statistics.median(latencies):.0f} ms, '
          f'last {max(latencies):.0f} ms')
    print(f'  CPU of the server: to receive the goals {asked - idle:.2f} s, while all wait '
          f'{(waited - asked) / WAIT_S * 100.0:.1f} %, to answer {answered - waited:.2f} s')
    print(f'  threads of the server: {threads(home)}; its memory: {memory_mb(home):.0f} MB')
    resume(asking)
    for process in asking:
        process.wait()
    ask_in_a_loop(node, home)
    server.terminate()
    server.wait()


def ask_in_a_loop(node: Node, server: Path) -> None:
    """Look up repeatedly with one client."""
    with BufferClient(node, ACTION) as client:
        assert client.wait_for_server(PATIENCE)
        times, begin, cpu = [], time.monotonic(), cpu_s(server)
        while time.monotonic() < begin + 10.0:
            start_of_one = time.perf_counter()
            client.lookup_transform('map', 'base', Time())
            times.append((time.perf_counter() - start_of_one) * 1e3)
    print(f'one client in a loop: {len(times) / 10.0:.0f} lookups a second, median '
          f'{statistics.median(times):.1f} ms; CPU of the server a lookup '
          f'{(cpu_s(server) - cpu) / len(times) * 1e3:.1f} ms')


def start(module: str, *arguments: str) -> 'subprocess.Popen[str]':
    """Start a process that pauses until ``resume``."""
    return subprocess.Popen([sys.executable, '-m', module, *arguments], stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, text=True)


def resume(processes: 'list[subprocess.Popen[str]]') -> None:
    """Resume processes."""
    for process in processes:
        assert process.stdin
        process.stdin.write('go\n')
        process.stdin.flush()


def a_transform() -> TransformStamped:
    """Return the transform map -> base at 1 s."""
    transform = TransformStamped(child_frame_id='base')
    transform.header.frame_id = 'map'
    transform.header.stamp.sec = 1
    return transform


def cpu_s(process: Path) -> float:
    """Return the CPU time of a process, user and system."""
    return sum(int(each.read_text().split()[0])
               for each in process.glob('task/*/schedstat')) / 1e9


def threads(process: Path) -> int:
    """Return the number of threads of a process, including those of the middleware."""
    return len(list((process / 'task').iterdir()))


def memory_mb(process: Path) -> float:
    """Return the resident memory of a process."""
    return int((process / 'statm').read_text().split()[1]) * 4096 / 1e6


if __name__ == '__main__':
    main()
