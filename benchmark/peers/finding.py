# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Determine which contestants are available, and why the others are not."""

from collections.abc import Callable, Collection, Mapping
import importlib
import importlib.util
from typing import Any

from . import debian, pure
from .ours import OurBuffer, OurCore
from ..exercise import Exercise, Task, Unable
from ..rows import CORE, DEBIAN, GTSAM, JAZZY, KINHEC, OURS, PURE, PYTRANSFORM, RUST, TF2_ROS

_TOLERANCE = 1e-9

_CURES = {
    **dict.fromkeys((JAZZY, TF2_ROS), 'needs an installed ROS 2 Jazzy: '
                    'sudo apt install ros-jazzy-tf2-ros-py'),
    **dict.fromkeys((RUST, PYTRANSFORM, GTSAM), 'not installed: '
                    'python3 -m pip install -r benchmark/requirements.txt'),
    KINHEC: 'not installed: scripts/setup --oracles',
}


class Disagreement(Exception):
    """Two contestants returned different results, so they cannot be compared."""


class Contestants:
    """
    All available contestants.

    :ivar absent: why each other contestant is unavailable, by name.
    """

    def __init__(self) -> None:
        self.absent: dict[str, str] = {}
        self._makers: dict[str, Callable[[], Any]] = {OURS: OurBuffer, CORE: OurCore}
        self.pure = self._try(PURE, pure.find)
        self.debian = self._try(DEBIAN, debian.find)
        self.rust = self._try(RUST, lambda: _load('rust').RustTree)
        self.pytransform = self._try(PYTRANSFORM, lambda: _load('pytransform').TemporalManager)
        self.tf2_ros = self._try(TF2_ROS, lambda: _load('jazzy').Tf2RosBuffer)
        self.gtsam = self._try(GTSAM, lambda: _load('factor_graph').FactorGraph)
        self.kinhec = self._try(KINHEC, _find_kinhec)
        here = {RUST: self.rust, TF2_ROS: self.tf2_ros,
                JAZZY: self._try(JAZZY, lambda: _load('jazzy').JazzyBuffer)}
        self._makers |= {name: maker for name, maker in here.items() if maker is not None}

    def exercises(
            self, task: Task,
            names: Collection[str] = (OURS, CORE, PURE, DEBIAN, TF2_ROS, JAZZY, RUST)
            ) -> dict[str, Any]:
        """
        Return an exercise for each of these contestants that is available; all agree.

        :raises Disagreement: their results differ.
        """
        exercises: dict[str, Any] = {}
        remote = {PURE: self.pure, DEBIAN: self.debian}
        for name in names:
            try:
                if name in self._makers:
                    exercises[name] = Exercise(self._makers[name](), task)
                elif remote.get(name):
                    exercises[name] = remote[name].exercise(task)
            except Unable as reason:
                self.absent[f'{name}, {task.robot}'] = str(reason)
        agree({name: exercise.answers() for name, exercise in exercises.items()})
        return exercises

    def has(self, name: str) -> bool:
        """Return whether a contestant of this process is available."""
        return name in self._makers

    def close(self) -> None:
        """End the processes."""
        for peer in self.pure, self.debian:
            if peer:
                peer.worker.close()

    def __enter__(self) -> 'Contestants':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _try(self, name: str, find: Callable[[], Any]) -> Any:
        try:
            return find()
        except ImportError as error:
            self.absent[name] = _CURES.get(name, str(error))
            return None


def agree(answers: Mapping[str, list[list[float]]]) -> None:
    """
    Compare the poses of the contestants, up to the quaternion's sign.

    :raises Disagreement: two differ; the message names them.
    """
    names = list(answers)
    for name in names[1:]:
        for one, other in zip(answers[names[0]], answers[name], strict=True):
            if _distance(one, other) > _TOLERANCE:
                raise Disagreement(f'{names[0]} returned {one}, and {name} returned {other}')


def _distance(one: list[float], other: list[float]) -> float:
    sign = 1.0 if sum(a * b for a, b in zip(one[3:], other[3:], strict=True)) > 0.0 else -1.0
    return max(
        *(abs(a - b) for a, b in zip(one[:3], other[:3], strict=True)),
        *(abs(a - sign * b) for a, b in zip(one[3:], other[3:], strict=True)))


def _find_kinhec() -> bool:
    """Return that it is installed; it is imported only by what uses it, since it is large."""
    if importlib.util.find_spec('kinhec') is None:
        raise ImportError('kinhec')
    return True


def _load(module: str) -> Any:
    return importlib.import_module(f'{__package__}.{module}')
