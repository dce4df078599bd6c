# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The processes of a lab over DDS, on this machine only and in a separate domain.

The domain is not shared with other labs on this machine. The lab's own process has a pipe to each
of the others. They wait on the pipe for requests and for the next tick, and end when it closes: so
they also end if the lab is killed.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
import multiprocessing
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import Any
from unittest import mock

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.topics.listener import TransformListener

# Users choose smaller numbers. The ports of these are above Linux's ephemeral ports.
FIRST_DOMAIN, DOMAINS = 216, 16


@contextmanager
def own_domain() -> Iterator[int]:
    """Reserve a domain within the context; if all are taken, share one."""
    start = os.getpid()
    ids = [FIRST_DOMAIN + (start + number) % DOMAINS for number in range(DOMAINS)]
    with closing(socket.socket(socket.AF_UNIX)) as claim:
        yield next((domain_id for domain_id in ids if _is_taken_by(claim, domain_id)), ids[0])


def _is_taken_by(claim: socket.socket, domain_id: int) -> bool:
    """Return whether a socket obtains a domain's name, which only one can have at a time."""
    try:
        # An abstract name, not a file: it disappears when the process ends, in any way.
        claim.bind(f'\0tf_tree_py lab, domain {domain_id}')
    except OSError:
        return False
    return True


# --- processes

PATIENCE_S = 60.0
"""How long a lab waits for its processes; on a busy machine, each takes half a minute to start."""

# How long a process may take to end, with its work done, before it is killed.
_END_S = 10.0

Work = Callable[..., None]

# Processes are forked from one that has only imported the shared modules.
_processes = multiprocessing.get_context('forkserver')
_processes.set_forkserver_preload(['tf_tree_py.ros', __name__])


class Session:
    """
    The processes of a running lab, and this one's own ROS context.

    :ivar context: in the lab's domain; ``node`` makes nodes in it.
    :ivar domain_id: the lab's domain.
    """

    def __init__(self, context: Context, domain_id: int) -> None:
        self.context = context
        self.domain_id = domain_id
        self._nodes: list[Node] = []
        self._processes: list[tuple[BaseProcess, Connection]] = []

    def node(self, name: str) -> Node:
        """Return a new node of this process; it lives as long as the session."""
        self._nodes.append(_small_node(name, self.context))
        return self._nodes[-1]

    def start(self, work: Work, *arguments: object) -> Connection:
        """
        Start a process that calls ``work(node, pipe, *arguments)``; return our end of the pipe.

        :param work: a function at the top of a module; the node gets its name.
        """
        ours, theirs = _processes.Pipe()
        process = _processes.Process(
            target=_play, args=(work, theirs, self.domain_id, arguments), daemon=True)
        with _keeping_ctrl_c():
            process.start()
        theirs.close()
        self._processes.append((process, ours))
        return ours

    def close(self) -> None:
        """
        End everything, one process after the other.

        While a process of the wheels leaves DDS, it may need a minute to notice that others leave
        too (docs/ending.md).
        """
        for process, pipe in self._processes:
            pipe.close()
            process.join(_END_S)
            if process.is_alive():
                process.kill()
                process.join()
        for node in self._nodes:
            node.destroy_node()
        self.context.try_shutdown()


@contextmanager
def session() -> Iterator[Session]:
    """Open a session in a separate domain, and close it at the end."""
    with own_domain() as domain_id, mock.patch.dict(os.environ):
        _surround_by(domain_id)
        opened = Session(new_context(), domain_id)
        try:
            yield opened
        finally:
            with _keeping_ctrl_c():
                opened.close()


def _surround_by(domain_id: int) -> None:
    """Set the environment variables for a domain on this machine only."""
    os.environ |= {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_DOMAIN_ID': str(domain_id)}
    os.environ.pop('ROS_STATIC_PEERS', None)


@contextmanager
def _keeping_ctrl_c() -> Iterator[None]:
    """
    Start processes that ignore Ctrl-C; the lab itself gets it after the start.

    A process inherits a blocked signal, but no handler. In the lab a handler delays the
    signal, because an interrupted start would leave half a process.
    """
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    pressed: list[Any] = []
    # Starting it later would unblock the signal.
    resource_tracker.ensure_running()
    signal.signal(signal.SIGINT, lambda *arguments: pressed.append(arguments))
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        signal.signal(signal.SIGINT, handler)
    if pressed:
        handler(*pressed[0])


def _play(work: Work, pipe: Connection, domain_id: int, arguments: tuple[object, ...]) -> None:
    """Run in a started process; Ctrl-C is for the lab, whose end closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _surround_by(domain_id)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = _small_node(work.__name__)
    # The lab has ended: it closed the pipe while we were reading or writing.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        work(node, pipe, *arguments)
    node.destroy_node()
    try_shutdown()


def new_context() -> Context:
    """Return a new context; to DDS it looks like a new process."""
    context = Context()
    rclpy.init(context=context, args=[], signal_handler_options=SignalHandlerOptions.NO)
    return context


def _small_node(name: str, context: Context | None = None) -> Node:
    """Return a node without the services and topics that a lab does not need."""
    return Node(name, context=context, use_global_arguments=False, enable_rosout=False,
                start_parameter_services=False)


@contextmanager
def lone_node(name: str) -> Iterator[Node]:
    """Yield a small node in a context of its own."""
    context = new_context()
    node = _small_node(name, context)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def answer(pipe: Connection) -> Any:
    """
    Return the next object that a process sends.

    :raises RuntimeError: it sends nothing for ``PATIENCE_S``, or has ended.
    """
    return answers([pipe])[0]


def answers(pipes: Sequence[Connection]) -> list[Any]:
    """
    Wait until a process sends something; return the next object of each that does.

    :raises RuntimeError: none sends anything for ``PATIENCE_S``, or one has ended.
    """
    ready = wait(pipes, PATIENCE_S)
    if not ready:
        raise RuntimeError(f'the processes of this lab sent nothing for {PATIENCE_S:g} s')
    try:
        return [pipe.recv() for pipe in ready if isinstance(pipe, Connection)]
    except (EOFError, ConnectionResetError):
        raise RuntimeError('a process of this lab ended prematurely') from None


def ticks(pipe: Connection, period: int) -> Iterator[None]:
    """
    Yield once per period (nanoseconds), until the pipe contains data.

    :raises EOFError: the pipe closes; at the next ``recv``.
    """
    start = time.monotonic_ns()
    number = 0
    while not pipe.poll(max(0, start + number * period - time.monotonic_ns()) / 1e9):
        yield
        # Ticks for which the machine was too busy are skipped.
        number = max(number, (time.monotonic_ns() - start) // period) + 1


@contextmanager
def listening(node: Node, observers: Sequence[Observer] = (),
              cache_time: Duration | None = None) -> Iterator[Buffer]:
    """Return a buffer that receives the transforms of the lab within the context."""
    buffer = Buffer(cache_time)
    for observer in observers:
        buffer.observers.add(observer)
    with TransformListener(buffer, node):
        yield buffer


@contextmanager
def executable(name: str, *arguments: str) -> Iterator[None]:
    """Run one of this package's executables in a process, and end it at the end."""
    with subprocess.Popen([sys.executable, '-m', f'tf_tree_py.nodes.{name}', *arguments],
                          stderr=subprocess.DEVNULL, start_new_session=True) as process:
        try:
            yield
        finally:
            process.terminate()
