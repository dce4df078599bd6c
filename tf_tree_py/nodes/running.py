# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Starts, runs and ends executables: Ctrl-C is a normal end, an error is one sentence.

A ``ClosingNode`` closes its resources when it is destroyed.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, ExitStack
from functools import partial
import threading
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import try_shutdown
from tf_tree_py.command import endings, signals
from tf_tree_py.command.arguments import Parser

from .bad_input import BadInput
from .parameters import describe, Setting


class _DestroyedOnError(type):
    """Destroys an object whose constructor raises; else its publishers would stay in the graph."""

    def __call__(cls, *arguments: object, **options: object) -> Any:
        node: Any = cls.__new__(cls)  # type: ignore[call-overload]
        try:
            node.__init__(*arguments, **options)
        except BaseException:
            node.destroy_node()
            raise
        return node


class ClosingNode(Node, metaclass=_DestroyedOnError):
    """
    A node that closes its resources before it is destroyed, the newest first.

    It is also destroyed if its constructor raises. It may be destroyed more than once, because
    rclpy does so, too, from Kilted on.
    """

    _is_complete = False

    def __init__(self, name: str, **node_options: Any) -> None:
        """
        Create a node without resources.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        """
        self._closing = ExitStack()
        super().__init__(name, **node_options)
        self._is_complete = True

    def destroy_node(self) -> None:
        """Close the resources, and destroy the node."""
        self._closing.close()
        # rclpy cannot destroy a node that it has refused, such as one with a wrong name.
        if self._is_complete:
            super().destroy_node()


# --- running

def run(prog: str, argv: Sequence[str] | None, work: Callable[[Future], None]) -> int:
    """
    Run a function with ROS until it returns or Ctrl-C; the process should end after it.

    By default rclpy would shut its context down while callbacks run, and Python would raise
    KeyboardInterrupt between any two lines. Here a signal completes a future and has no other
    effect. Pressing Ctrl-C again does not interrupt the clean-up.

    :param argv: the whole command line; None: that of this process.
    :param work: makes nodes and spins them until its argument, a future, is done.
    :return: the exit status.
    """
    def with_ros(_: Sequence[str]) -> int:
        ended = Future()
        signals.call_on_signal(partial(ended.set_result, None))
        try:
            _init(argv)
            work(ended)
        finally:
            # rclpy.try_shutdown of Kilted also removes signal handlers that rclpy has not
            # installed: for a moment Ctrl-C would kill the process.
            try_shutdown()
        return endings.FINE

    return endings.run(prog, with_ros, argv, endings.FINE)


def main_of(prog: str, description: str, examples: Sequence[tuple[str, str]],
            settings: Sequence[Setting], make: Callable[[], Node]) -> Callable[..., int]:
    """
    Return the ``main`` of an executable that spins one node, and has no arguments of its own.

    :param examples: command lines, each with a description, for the help.
    :param settings: its parameters, likewise.
    """
    def main(argv: Sequence[str] | None = None) -> int:
        """
        Run the executable; return its exit status.

        :param argv: the whole command line; None: that of this process.
        """
        parser = Parser(prog, description, examples, epilog=describe(settings))
        parser.parse_args(parser.own_arguments(argv))
        return run(prog, argv, lambda ended: spin(make(), ended))

    return main


def _init(argv: Sequence[str] | None) -> None:
    try:
        rclpy.init(args=None if argv is None else list(argv),
                   signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise BadInput(_sentence(error)) from error


def _sentence(error: Exception) -> str:
    """Return the text of an rcl error, without file names and line numbers."""
    text = str(error).split(', at /')[0]
    # For unknown arguments its text is only their list.
    return f'unknown ROS arguments {text}' if text.startswith('[') else text


def spin(node: Node, ended: Future, seconds: float | None = None) -> None:
    """Spin a node until a future is done or for a number of seconds, then destroy it."""
    with _executor_of(node) as executor:
        executor.spin_until_future_complete(ended, seconds)


@contextmanager
def spun_in_background(node: Node) -> Iterator[None]:
    """Spin a node in a separate thread within the context, then destroy it."""
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
