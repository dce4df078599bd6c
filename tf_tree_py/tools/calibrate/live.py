# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Records observations of a running system, and reports what they do not show yet."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
import importlib
import sys
import threading
import time
from typing import Any

from tf_tree_py.calibration import Calibration, CalibrationError
from tf_tree_py.calibration.chain import check_edges, Tree
from tf_tree_py.calibration.detections import (
    check_type,
    Detection,
    detections_in,
    FRAME,
    gathered,
    seen_on_tf,
)
from tf_tree_py.calibration.observations import Observations
from tf_tree_py.command.arguments import shown
from tf_tree_py.command.endings import Cannot
from tf_tree_py.command.signals import wait
from tf_tree_py.core import TransformException
from tf_tree_py.ros.topics.qos import sensor_qos
from tf_tree_py.ros.topics.side_topics import SideTopics

from .report import hidden

_SECONDS = 60.0
_REPORT_S = 5.0
_LOOK_S = 0.2
_DEPTH = 100

_Estimator = Callable[[Tree, Namespace, Sequence[Observations]], Calibration]


def recorded_live(tree_input: Any, arguments: Namespace, estimated: _Estimator) -> Calibration:
    """
    Return the calibration from the observations of some seconds, or until Ctrl-C.

    Every few seconds, standard error reports the unobservable directions, and how to move.

    :param tree_input: the live tree.
    :raises Cannot: the type of a topic is not installed.
    :raises CalibrationError: a topic was not published; or see ``calibrate``.
    """
    collector = _Collector(tree_input, arguments)
    try:
        with suppress(KeyboardInterrupt):
            _watch(collector, arguments, estimated)
        check_edges(tree_input.buffer, [(parent, child) for parent, child in arguments.edge])
        collector.check()
        return estimated(tree_input.buffer.snapshot(), arguments, collector.sets())
    finally:
        collector.close()


def _watch(collector: '_Collector', arguments: Namespace, estimated: _Estimator) -> None:
    begin = time.monotonic()
    seconds, due = arguments.seconds or _SECONDS, _REPORT_S
    while (elapsed := time.monotonic() - begin) < seconds:
        collector.look()
        wait(min(_LOOK_S, seconds - elapsed))
        if elapsed >= due:
            _print_state(collector, arguments, estimated, elapsed)
            due = time.monotonic() - begin + _REPORT_S


def _print_state(collector: '_Collector', arguments: Namespace, estimated: _Estimator,
                 elapsed: float) -> None:
    """Print the directions that the observations so far do not show."""
    try:
        found = estimated(collector.buffer.snapshot(), arguments, collector.sets())
    except (CalibrationError, TransformException) as error:
        said = [str(error)]
    else:
        said = [found.contradiction.what] if found.contradiction is not None else [
            f'not seen yet: {each}' for each in hidden(found)] or [
            f'everything is observable from {found.observations} observations; more of them '
            'reduce the error']
    for sentence in said:
        print(f'{elapsed:4.0f} s  {shown(sentence, 300)}', file=sys.stderr, flush=True)


class _Collector:
    """
    A collection of the messages of topics, also of those that appear late.

    :ivar buffer: the live tree.
    """

    def __init__(self, tree_input: Any, arguments: Namespace) -> None:
        self.buffer = tree_input.buffer
        self._tree_input, self._fixed_in = tree_input, arguments.fixed_in
        self._known = dict(arguments.known)
        self._frames = [name.removeprefix(FRAME) for name in arguments.observations
                        if name.startswith(FRAME)]
        self._missing = {name for name in arguments.observations if not name.startswith(FRAME)}
        self._found: dict[str, list[Detection]] = {}
        self._lock = threading.Lock()
        self._topics = SideTopics(self, tree_input.node, 'observations_impl')

    def look(self) -> None:
        """Subscribe to the topics that have appeared."""
        if not self._missing:
            return
        for topic, types in self._tree_input.node.get_topic_names_and_types():
            for name in [each for each in self._missing
                         if self._tree_input.node.resolve_topic_name(each) == topic]:
                check_type(types[0])
                self._missing.discard(name)
                with self._lock:
                    found = self._found.setdefault(name, [])
                # The callback holds no reference to this object, so that it can be collected.
                self._topics.subscribe(_message_type(types[0]), topic, partial(
                    _receive, self._lock, found, types[0]), sensor_qos(_DEPTH))

    def check(self) -> None:
        """
        Check that all topics have appeared.

        :raises CalibrationError: one has not.
        """
        if self._missing:
            raise CalibrationError(
                f'no node published {", ".join(sorted(self._missing))}: check that the node '
                'runs with the same ROS_DOMAIN_ID')

    def sets(self) -> list[Observations]:
        """Return all observations so far."""
        with self._lock:
            found = {name: list(each) for name, each in self._found.items()}
        sets = [each for name, detections in found.items()
                for each in gathered(detections, self._fixed_in, self._known, name)]
        return sets + [seen_on_tf(self.buffer, frame, self._fixed_in, self._known)
                       for frame in self._frames]

    def close(self) -> None:
        """Unsubscribe."""
        self._topics.close()


def _receive(lock: threading.Lock, found: list[Detection], type_name: str, message: Any) -> None:
    detections = detections_in(type_name, message)
    with lock:
        found += detections


def _message_type(name: str) -> Any:
    package, _, message = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), message)
    except (ImportError, AttributeError) as error:
        raise Cannot(f'messages of {name} cannot be read: {package} is not installed here'
                     ) from error
