# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reading static transforms from a command line or from a YAML file, without ROS.

Both have the same keywords (``x``, ``yaw``, ``frame_id``), defaults and checks.
"""

from collections.abc import Iterable, Mapping
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.beyond.uncertainty.covariances import checked_covariance
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.command.endings import cannot_after
from tf_tree_py.core import InvalidArgumentException, LATEST, Pose
from tf_tree_py.core.geometry.so3 import Array

from .bad_input import BadInput
from .static_words import ANGLES, COVARIANCE, DECIMAL, FRAMES, QUATERNION, TRANSLATION, WORDS

_IN_FILE = 'transforms'


class StaticTransform(NamedTuple):
    """
    ``parent_T_child``, valid at all times.

    :ivar covariance: (6, 6); None if unknown.
    """

    parent: str
    child: str
    pose: Pose
    covariance: Array | None = None

    def __str__(self) -> str:
        return f'{self.parent} -> {self.child}: {self.pose}'


def from_words(words: Mapping[str, object]) -> StaticTransform:
    """
    Return the transform that keywords describe.

    As in tf2, omitted numbers are 0, and an omitted qw is 1. Any quaternion that is not all
    zero is accepted, and normalised.

    :param words: some of ``WORDS``, each with its value.
    :raises BadInput: they do not describe a transform.
    """
    for word in words:
        if word not in WORDS:
            raise BadInput(f'{word!r} is unknown; use {", ".join(WORDS)}')
    parent, child = (_frame(word, words.get(word)) for word in FRAMES)
    if parent == child:
        raise BadInput(f'the frame id and the child frame id are both {parent!r}')
    covariance = _covariance(words.get(COVARIANCE))
    translation = [_number(word, words.get(word, 0.0)) for word in TRANSLATION]
    angles = [_number(word, words.get(word, 0.0)) for word in ANGLES]
    quaternion = [_number(word, words.get(word, float(word == 'qw'))) for word in QUATERNION]
    if not words.keys() & set(ANGLES):
        if not any(quaternion):
            raise BadInput('the quaternion is all zero; for no rotation, use 0 0 0 1')
        return StaticTransform(parent, child, Pose.from_parts(translation, quaternion), covariance)
    if words.keys() & set(QUATERNION):
        raise BadInput('give a rotation as qx qy qz qw or as roll pitch yaw, not both')
    return StaticTransform(parent, child, Pose.from_xyz_rpy(*translation, *angles), covariance)


def _frame(word: str, value: object) -> str:
    word = word.replace('_', ' ')
    if value is None:
        raise BadInput(f'the {word} is missing')
    if not isinstance(value, str):
        raise BadInput(f'the {word} is {value!r}, which YAML does not read as a string: enclose '
                       'it in quotes')
    # Old launch files have a leading slash, which listeners strip too.
    name = value.removeprefix('/')
    if not name:
        raise BadInput(f'the {word} is empty')
    return name


def _number(word: str, value: object) -> float:
    # YAML reads 1e-3 as a string, and in Python True is 1.
    wrong = (not DECIMAL.fullmatch(value.strip()) if isinstance(value, str)
             else isinstance(value, bool))
    try:
        number = math.nan if wrong else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f'{word} is {value!r:.60}, which is not a finite number')
    return number


def _covariance(value: object) -> Array | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) not in (6, 36):
        raise BadInput(f'the covariance is {value!r:.60}; it must be a list of six variances, '
                       'or of 36 numbers')
    numbers = np.array([_number('a number of the covariance', number) for number in value])
    with cannot_after(InvalidArgumentException, ending=BadInput):
        return checked_covariance(np.diag(numbers) if len(numbers) == 6 else numbers)


def from_yaml(path: str) -> list[StaticTransform]:
    """
    Return the transforms that a file lists.

    :raises BadInput: the file cannot be read, or its content is wrong.
    """
    content = _load(path)
    items = content.get(_IN_FILE) if isinstance(content, Mapping) else None
    if not isinstance(items, list) or not items or len(content) > 1:
        raise BadInput(f'{path} must contain a list named {_IN_FILE}, and nothing else')
    return _consistent([_from_item(f'{path}, transform {i}', item)
                        for i, item in enumerate(items, start=1)], path)


def _load(path: str) -> Any:
    try:
        import yaml
    except ModuleNotFoundError:
        raise BadInput(
            'reading YAML needs PyYAML: apt install python3-yaml, or pip install pyyaml') from None
    try:
        from .static_yaml import read_yaml
        with open(path, encoding='utf-8') as file:
            return read_yaml(file)
    except OSError as error:
        raise BadInput(f'{path} cannot be read: {error.strerror}') from error
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        raise BadInput(f'{path} is not YAML: {" ".join(str(error).split())}') from error


def _from_item(where: str, item: object) -> StaticTransform:
    if not isinstance(item, Mapping):
        raise BadInput(f'{where}: {item!r} must be keys and values, such as x: 1.0')
    try:
        return from_words(item)
    except BadInput as error:
        raise BadInput(f'{where}: {error}') from error


def _consistent(transforms: Iterable[StaticTransform], path: str) -> list[StaticTransform]:
    """Return the transforms, checked to form a tree: each child once, and no loop."""
    tree = BufferCore()
    taken: dict[str, StaticTransform] = {}
    for transform in transforms:
        parent, child, pose, _ = transform
        if child in taken:
            raise BadInput(f'{path}: {child!r} appears twice, under {taken[child].parent!r} and '
                           f'under {parent!r}; a frame has one parent')
        refused = tree.insert(parent, child, LATEST, pose, authority=path, static=True,
                              strict=False)
        if refused:
            raise BadInput(f'{path}: {parent!r} -> {child!r} {refused[0].kind.value}')
        taken[child] = transform
    return list(taken.values())
