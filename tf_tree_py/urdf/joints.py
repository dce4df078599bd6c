# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joints: the links that they connect, their motion, and the names of their variables."""

import math
from typing import NamedTuple

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.text import nearest

from .xml_elements import DescriptionError, Element, quoted
from .xml_values import number, numbers, origin_of

FIXED, PRISMATIC, PLANAR, FLOATING = 'fixed', 'prismatic', 'planar', 'floating'
TURNING = ('revolute', 'continuous')

# The suffixes of a joint's name in the names of its variables, as in MoveIt.
_PARTS: dict[str, tuple[str, ...]] = {
    FIXED: (), PRISMATIC: ('',), **dict.fromkeys(TURNING, ('',)), PLANAR: ('/x', '/y', '/theta'),
    FLOATING: ('/trans_x', '/trans_y', '/trans_z', '/rot_x', '/rot_y', '/rot_z', '/rot_w'),
}
_DEFAULT_AXIS = (1.0, 0.0, 0.0)
# All programs take the x-y plane for a planar joint without an axis.
_DEFAULT_NORMAL = (0.0, 0.0, 1.0)


class Mimic(NamedTuple):
    """A joint's position is that of another ``joint`` times ``multiplier``, plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


class Joint(NamedTuple):
    """
    One joint, which is one edge of the tree.

    :ivar kind: fixed, revolute, continuous, prismatic, planar or floating.
    :ivar origin: ``parent_T_child`` if all variables are zero.
    :ivar axis: a unit vector in the child: the axis of rotation, the direction of sliding, or
        the normal of the plane.
    :ivar mimic: the joint that it follows; None: it follows no joint.
    :ivar limits: the least and the greatest position, metres or radians; None: there are no
        limits, or they cannot be read, because transforms do not need them.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Vector3
    mimic: Mimic | None = None
    limits: tuple[float, float] | None = None

    @property
    def edge(self) -> tuple[str, str]:
        """Return the parent link and the child link."""
        return self.parent, self.child

    @property
    def variables(self) -> tuple[str, ...]:
        """
        Return the names of its variables: metres, radians, and a quaternion's x y z w.

        A single variable has the name of the joint, as in every JointState. The names of a
        planar joint end in /x, /y, /theta, and those of a floating one in /trans_x ... /rot_w.
        """
        return tuple(f'{self.name}{part}' for part in _PARTS[self.kind])

    @property
    def rest(self) -> tuple[float, ...]:
        """Return the values of its variables at its origin."""
        return tuple(float(part == '/rot_w') for part in _PARTS[self.kind])


def joint_of(element: Element) -> Joint:
    """
    Return the joint that an element describes.

    :raises DescriptionError: a part of it is missing, or is not a number.
    """
    name = element.attribute('name', 'give every joint a unique name')
    kind = element.attribute('type', f'write one of {", ".join(_PARTS)}')
    if kind not in _PARTS:
        meant = nearest(kind, _PARTS)
        raise element.error(f'it has the type {quoted(kind)}',
                            f'did you mean {meant}?' if meant else
                            f'write one of {", ".join(_PARTS)}')
    return Joint(name, kind, _link_of(element, 'parent'), _link_of(element, 'child'),
                 origin_of(element), _axis_of(element, kind), _mimic_of(element, kind),
                 _limits_of(element, kind))


def _link_of(joint: Element, end: str) -> str:
    element = joint.first(end)
    fix = f'write <{end} link="..."/> with the name of a link'
    if element is None:
        raise joint.error(f'it has no {end}', fix)
    return element.attribute('link', fix)


def _axis_of(joint: Element, kind: str) -> Vector3:
    """Return the axis, a unit vector. The axis of a joint that needs none is not read."""
    element = joint.first('axis')
    if element is None or kind in (FIXED, FLOATING):
        return _DEFAULT_NORMAL if kind == PLANAR else _DEFAULT_AXIS
    x, y, z = numbers(element, 'xyz', _DEFAULT_AXIS)
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise element.error('its axis is zero' if length == 0.0 else 'its axis is too long',
                            'give it a direction, such as xyz="0 0 1"')
    return x / length, y / length, z / length


def _limits_of(joint: Element, kind: str) -> tuple[float, float] | None:
    element = joint.first('limit')
    if element is None or kind not in ('revolute', PRISMATIC):
        return None
    try:
        least, most = number(element, 'lower', 0.0), number(element, 'upper', 0.0)
    except DescriptionError:
        return None
    return (least, most) if least < most else None


def _mimic_of(joint: Element, kind: str) -> Mimic | None:
    element = joint.first('mimic')
    if element is None or kind == FIXED:
        return None
    if len(_PARTS[kind]) > 1:
        raise element.error(f'it mimics another joint, but it is {kind}',
                            'remove the <mimic>: only a joint with one variable can follow')
    return Mimic(element.attribute('joint', 'write the name of the joint that it follows'),
                 number(element, 'multiplier', 1.0), number(element, 'offset', 0.0))
