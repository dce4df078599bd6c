# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Starts, runs and ends executables: Ctrl-C is a normal end, a mistake gets one sentence."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import ctypes
import os
import signal
import sys
import threading
from typing import Any, NoReturn

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

from .bad_input import BadInput


class Parser(argparse.ArgumentParser):
    """Reads the arguments that are not ROS's; an error is one sentence."""

    def __init__(self, prog: str, description: str, epilog: str = '', **options: Any) -> None:
        super().__init__(prog=prog, description=description, epilog=epilog, allow_abbrev=False,
                         formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message: str) -> NoReturn:
        """Exit with status 2, as is usual after wrong arguments."""
        self.exit(2, f'{self.prog}: {message} (--help tells more)\n')

    def own_arguments(self, argv: Sequence[str] | None) -> list[str]:
        """Return the arguments that are not for ROS, without the program's name."""
        try:
            return list(remove_ros_args(argv))[1:]
        except RuntimeError as error:
            self.error(_sentence(error))


def run(prog: str, argv: Sequence[str] | None, work: Callable[[Future], None]) -> int:
    """
    Do something with ROS until it is done or Ctrl-C; the process should end after it.

    :param argv: the whole command line; None: this process's.
    :param work: makes nodes and spins them until its argument is done.
    :return: the exit status.
    """
    ended = _on_signal()
    try:
        _init(argv)
        work(ended)
    except BadInput as error:
        print(f'{prog}: {error}', file=sys.stderr)
        return 1
    except BrokenPipeError:
        pass  # the reader of our output has left, as `| head` does
    finally:
        rclpy.try_shutdown()
        _ignore_signals()
    return 0


def _on_signal() -> Future:
    """
    Return a future that Ctrl-C or SIGTERM completes; the signals have no other effect.

    By default rclpy would shut its context down while nodes are at work, and Python would
    raise KeyboardInterrupt between any two lines. Here a signal wakes a thread at once, even
    while the main thread waits in C. Pressing Ctrl-C again does not interrupt the clean-up.
    """
    ended = Future()
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    _handle_signals(lambda *_: None)

    def wait() -> None:
        os.read(read_end, 1)
        ended.set_result(None)

    threading.Thread(target=wait, name='signals', daemon=True).start()
    return ended


def _handle_signals(handler: Any) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def _ignore_signals() -> None:
    """
    Let no signal disturb the end of the process, where Python gives every other handler up.

    First only where they arrive: Python prints a traceback for one that came just before
    it heard that it is to be ignored.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        ctypes.pythonapi.PyOS_setsig(number, ctypes.c_void_p(signal.SIG_IGN))
    _handle_signals(signal.SIG_IGN)


def _init(argv: Sequence[str] | None) -> None:
    try:
        rclpy.init(args=None if argv is None else list(argv),
                   signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise BadInput(_sentence(error)) from error


def _sentence(error: Exception) -> str:
    """Return the text of an rcl error, without file names and line numbers."""
    text = str(error).split(', at /')[0]
    # For unknown arguments its text is their list and nothing else.
    return f'unknown ROS arguments {text}' if text.startswith('[') else text


def spin(node: Node, ended: Future, seconds: float | None = None) -> None:
    """Spin a node until a future is done or so many seconds have passed; then destroy it."""
    with _executor_of(node) as executor:
        executor.spin_until_future_complete(ended, seconds)


@contextmanager
def spun_in_background(node: Node) -> Iterator[None]:
    """Spin a node in a thread of its own while the block runs; then destroy it."""
    done = Future()
    with _executor_of(node) as executor:
        thread = threading.Thread(
            target=executor.spin_until_future_complete, args=(done,), name=node.get_name())
        thread.start()
        try:
            yield
        finally:
            done.set_result(None)
            thread.join()


@contextmanager
def _executor_of(node: Node) -> Iterator[SingleThreadedExecutor]:
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        yield executor
    finally:
        executor.shutdown()
        node.destroy_node()
