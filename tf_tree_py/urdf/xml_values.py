# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Numbers, vectors and poses as a robot description writes them."""

import math

from tf_tree_py.core.geometry.pose import Pose

from .xml_elements import Element, quoted


def number(element: Element, name: str, default: float) -> float:
    """Return the number in an attribute, or a default without the attribute; see ``numbers``."""
    return numbers(element, name, (default,))[0]


def positive(element: Element, name: str, count: int = 1) -> tuple[float, ...]:
    """
    Return the sizes in an attribute.

    :raises DescriptionError: the attribute is missing, or a size is not greater than zero.
    """
    element.attribute(name, f'write {_numbers(count)}, metres')
    found = numbers(element, name, (math.nan,) * count)
    if min(found) <= 0.0:
        raise element.error(f'<{element.tag}> has the {name} {quoted(element.attributes[name])}',
                            'write a size greater than zero')
    return found


def numbers(element: Element, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """
    Return the numbers in an attribute.

    :param default: the result without the attribute. Its length is the expected count.
    :raises DescriptionError: the count is wrong, or a word is not a number.
    """
    text = element.attributes.get(name)
    if text is None:
        return default
    words = text.split()
    what = f'<{element.tag}> has the {name} {quoted(text)}'
    if len(words) != len(default):
        raise element.error(what, f'write {_numbers(len(default))}, with spaces between them')
    found = tuple(map(_finite, words))
    for word, value in zip(words, found, strict=True):
        if value is None:
            hint = ', expand it with xacro first' if '$' in word else ''
            raise element.error(f'{what}, and {quoted(word)} is not a number',
                                f'write a finite number, such as 0.25{hint}')
    return tuple(value for value in found if value is not None)


def _finite(word: str) -> float | None:
    """Return a finite number; None if the word is not one. Unlike in Python, 1_0 is not one."""
    try:
        value = math.nan if '_' in word else float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _numbers(count: int) -> str:
    return 'one number' if count == 1 else f'{count} numbers'


def origin_of(element: Element) -> Pose:
    """
    Return the pose of the <origin> in an element: metres, and radians about fixed axes.

    :raises DescriptionError: a word in it is not a number, or a quaternion is zero.
    """
    origin = element.first('origin')
    if origin is None:
        return Pose()
    xyz = numbers(origin, 'xyz', (0.0, 0.0, 0.0))
    if 'quat_xyzw' not in origin.attributes:
        return Pose.from_xyz_rpy(*xyz, *numbers(origin, 'rpy', (0.0, 0.0, 0.0)))
    quaternion = numbers(origin, 'quat_xyzw', (0.0, 0.0, 0.0, 1.0))
    if not any(quaternion):
        raise origin.error('<origin> has a zero quat_xyzw', 'for no rotation write 0 0 0 1')
    return Pose.from_parts(xyz, quaternion)
