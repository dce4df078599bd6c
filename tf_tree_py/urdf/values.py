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

"""Numbers, vectors and poses as a robot description writes them."""

import math

from tf_tree_py.core.geometry.pose import Pose

from .elements import Element, quoted


def number(element: Element, name: str, default: float) -> float:
    """Return one number of an attribute, or what it is without one; see ``numbers``."""
    return numbers(element, name, (default,))[0]


def positive(element: Element, name: str, count: int = 1) -> tuple[float, ...]:
    """
    Return sizes that have to be there.

    :raises DescriptionError: they are not, or one is not greater than zero.
    """
    element.attribute(name, f'give it {_numbers(count)}, metres')
    found = numbers(element, name, (math.nan,) * count)
    if min(found) <= 0.0:
        raise element.error(f'<{element.tag}> has the {name} {quoted(element.attributes[name])}',
                            'a size is greater than zero')
    return found


def numbers(element: Element, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """
    Return the numbers of an attribute.

    :param default: what they are without the attribute; it says how many there are.
    :raises DescriptionError: another count, or a number that is none.
    """
    text = element.attributes.get(name)
    if text is None:
        return default
    words = text.split()
    what = f'<{element.tag}> has the {name} {quoted(text)}'
    if len(words) != len(default):
        raise element.error(what, f'it takes {_numbers(len(default))}, with spaces between them')
    found = tuple(map(_finite, words))
    for word, value in zip(words, found, strict=True):
        if value is None:
            hint = ', expand it with xacro first' if '$' in word else ''
            raise element.error(f'{what}, and {quoted(word)} is no number',
                                f'write a finite one, such as 0.25{hint}')
    return tuple(value for value in found if value is not None)


def _finite(word: str) -> float | None:
    """Return a finite number; None for what is none. To Python 1_0 is one, to nobody else."""
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

    :raises DescriptionError: a number in it is none, or a quaternion is all zero.
    """
    origin = element.first('origin')
    if origin is None:
        return Pose()
    xyz = numbers(origin, 'xyz', (0.0, 0.0, 0.0))
    if 'quat_xyzw' not in origin.attributes:
        return Pose.from_xyz_rpy(*xyz, *numbers(origin, 'rpy', (0.0, 0.0, 0.0)))
    quaternion = numbers(origin, 'quat_xyzw', (0.0, 0.0, 0.0, 1.0))
    if not any(quaternion):
        raise origin.error('<origin> has a quat_xyzw that is all zero',
                           'for no rotation write 0 0 0 1')
    return Pose.from_parts(xyz, quaternion)
