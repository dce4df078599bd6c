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

"""Joints: which links they connect, how they move, and what their variables are called."""

import math
from typing import NamedTuple

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.suggest import nearest

from .elements import Element, quoted
from .values import number, numbers, origin_of

FIXED, PRISMATIC, PLANAR, FLOATING = 'fixed', 'prismatic', 'planar', 'floating'
TURNING = ('revolute', 'continuous')

# What follows the name of a joint in those of its variables, as MoveIt has it.
_PARTS: dict[str, tuple[str, ...]] = {
    FIXED: (), PRISMATIC: ('',), **dict.fromkeys(TURNING, ('',)), PLANAR: ('/x', '/y', '/theta'),
    FLOATING: ('/trans_x', '/trans_y', '/trans_z', '/rot_x', '/rot_y', '/rot_z', '/rot_w'),
}
_DEFAULT_AXIS = (1.0, 0.0, 0.0)
# Of a plane without a normal, all programs take x and y.
_DEFAULT_NORMAL = (0.0, 0.0, 1.0)


class Mimic(NamedTuple):
    """Where a joint follows another: at ``multiplier`` times its position, plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


class Joint(NamedTuple):
    """
    One joint, and so one edge: a link in another.

    :ivar kind: one of URDF's six: fixed, revolute, continuous, prismatic, planar, floating.
    :ivar origin: ``parent_T_child`` while all of its variables are zero.
    :ivar axis: of length one, in the child: it turns about it, slides along it, or it is the
        normal of the plane.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Vector3
    mimic: Mimic | None = None

    @property
    def edge(self) -> tuple[str, str]:
        """Return the two links, the parent first."""
        return self.parent, self.child

    @property
    def variables(self) -> tuple[str, ...]:
        """
        Return what its positions are called: metres, radians, and a quaternion's x y z w.

        The name of the joint if it has one of them, as in every JointState. Those of a planar
        joint end in /x, /y, /theta, and those of a floating one in /trans_x ... /rot_w.
        """
        return tuple(f'{self.name}{part}' for part in _PARTS[self.kind])

    @property
    def rest(self) -> tuple[float, ...]:
        """Return its variables where it is at its origin."""
        return tuple(float(part == '/rot_w') for part in _PARTS[self.kind])


def joint_of(element: Element) -> Joint:
    """
    Return the joint that an element describes.

    :raises DescriptionError: something of it is missing, or no number.
    """
    name = element.attribute('name', 'give every joint a name of its own')
    kind = element.attribute('type', f'say which: {", ".join(_PARTS)}')
    if kind not in _PARTS:
        meant = nearest(kind, _PARTS)
        raise element.error(f'it has the type {quoted(kind)}',
                            f'did you mean {meant}?' if meant else
                            f'there are {", ".join(_PARTS)}')
    return Joint(name, kind, _link_of(element, 'parent'), _link_of(element, 'child'),
                 origin_of(element), _axis_of(element, kind), _mimic_of(element, kind))


def _link_of(joint: Element, end: str) -> str:
    element = joint.first(end)
    mend = f'write <{end} link="..."/> with the name of a link'
    if element is None:
        raise joint.error(f'it has no {end}', mend)
    return element.attribute('link', mend)


def _axis_of(joint: Element, kind: str) -> Vector3:
    """Return the axis, of length one; of a joint that needs none, whatever is written is fine."""
    element = joint.first('axis')
    if element is None or kind in (FIXED, FLOATING):
        return _DEFAULT_NORMAL if kind == PLANAR else _DEFAULT_AXIS
    x, y, z = numbers(element, 'xyz', _DEFAULT_AXIS)
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise element.error('its axis is zero' if length == 0.0 else 'its axis is too long',
                            'give it a direction, such as xyz="0 0 1"')
    return x / length, y / length, z / length


def _mimic_of(joint: Element, kind: str) -> Mimic | None:
    element = joint.first('mimic')
    if element is None or kind == FIXED:
        return None
    if len(_PARTS[kind]) > 1:
        raise element.error(f'it mimics, and is {kind}',
                            'take the <mimic> out: only joints with one position follow others')
    return Mimic(element.attribute('joint', 'name the joint that it follows'),
                 number(element, 'multiplier', 1.0), number(element, 'offset', 0.0))
