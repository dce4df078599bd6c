# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Joints: the links that they connect, the names of their variables, and their poses.

The positions of joints that mimic others are a multiple of another position, plus an offset. The
poses of many joints at many positions are computed at once, in numpy.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.text import nearest

from .robot_xml import DescriptionError, Element, number, numbers, origin_of, quoted

FIXED, PRISMATIC, PLANAR, FLOATING = 'fixed', 'prismatic', 'planar', 'floating'
_TURNING = ('revolute', 'continuous')

# The suffixes of a joint's name in the names of its variables, as in MoveIt.
_PARTS: dict[str, tuple[str, ...]] = {
    FIXED: (), PRISMATIC: ('',), **dict.fromkeys(_TURNING, ('',)), PLANAR: ('/x', '/y', '/theta'),
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

    :ivar joint_type: fixed, revolute, continuous, prismatic, planar or floating.
    :ivar origin: ``parent_T_child`` if all variables are zero.
    :ivar axis: a unit vector in the child: the axis of rotation, the direction of sliding, or
        the normal of the plane.
    :ivar mimic: the joint that it follows; None: it follows no joint.
    :ivar limits: the least and the greatest position, metres or radians; None: there are no
        limits, or they cannot be read, because transforms do not need them.
    """

    name: str
    joint_type: str
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
        return tuple(f'{self.name}{part}' for part in _PARTS[self.joint_type])

    @property
    def rest(self) -> tuple[float, ...]:
        """Return the values of its variables at its origin."""
        return tuple(float(part == '/rot_w') for part in _PARTS[self.joint_type])


def joint_of(element: Element, warnings: list[str]) -> Joint:
    """
    Return the joint that an element describes.

    :param warnings: a sentence is added for an attribute that is ignored.
    :raises DescriptionError: a part of it is missing, or is not a number.
    """
    name = element.attribute('name', 'give every joint a unique name')
    joint_type = element.attribute('type', f'write one of {", ".join(_PARTS)}')
    if joint_type not in _PARTS:
        meant = nearest(joint_type, _PARTS)
        raise element.error(f'it has the type {quoted(joint_type)}',
                            f'did you mean {meant}?' if meant else
                            f'write one of {", ".join(_PARTS)}')
    return Joint(name, joint_type, _link_of(element, 'parent'), _link_of(element, 'child'),
                 origin_of(element, warnings), _axis_of(element, joint_type),
                 _mimic_of(element, joint_type), _limits_of(element, joint_type))


def _link_of(joint: Element, end: str) -> str:
    element = joint.first(end)
    fix = f'write <{end} link="..."/> with the name of a link'
    if element is None:
        raise joint.error(f'it has no {end}', fix)
    return element.attribute('link', fix)


def _axis_of(joint: Element, joint_type: str) -> Vector3:
    """Return the axis, a unit vector. The axis of a joint that needs none is not read."""
    element = joint.first('axis')
    if element is None or joint_type in (FIXED, FLOATING):
        return _DEFAULT_NORMAL if joint_type == PLANAR else _DEFAULT_AXIS
    x, y, z = numbers(element, 'xyz', _DEFAULT_AXIS)
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise element.error('its axis is zero' if length == 0.0 else 'its axis is too long',
                            'give it a direction, such as xyz="0 0 1"')
    return x / length, y / length, z / length


def _limits_of(joint: Element, joint_type: str) -> tuple[float, float] | None:
    element = joint.first('limit')
    if element is None or joint_type not in ('revolute', PRISMATIC):
        return None
    try:
        least, most = number(element, 'lower', 0.0), number(element, 'upper', 0.0)
    except DescriptionError:
        return None
    return (least, most) if least < most else None


def _mimic_of(joint: Element, joint_type: str) -> Mimic | None:
    element = joint.first('mimic')
    if element is None or joint_type == FIXED:
        return None
    if len(_PARTS[joint_type]) > 1:
        raise element.error(f'it mimics another joint, but it is {joint_type}',
                            'remove the <mimic>: only a joint with one variable can follow')
    return Mimic(element.attribute('joint', 'write the name of the joint that it follows'),
                 number(element, 'multiplier', 1.0), number(element, 'offset', 0.0))


# --- joints that mimic others

# The greatest multiplier, and offset in metres or radians. No real mechanism has as much.
_LARGEST = 1e9


class MimicJoints(NamedTuple):
    """
    The variables that follow when others are set, as indices into all variables.

    :ivar columns: (K,) the variables that follow.
    :ivar leaders: (K,) the variable that each of them follows.
    :ivar multipliers: (K,)
    :ivar offsets: (K,) metres or radians.
    """

    columns: npt.NDArray[np.intp]
    leaders: npt.NDArray[np.intp]
    multipliers: Array
    offsets: Array

    def follow(self, values: Array) -> bool:
        """Set the followers in values (..., variables); return whether all are finite."""
        if not len(self.columns):
            return True
        with np.errstate(over='ignore'):
            found = values[..., self.leaders] * self.multipliers + self.offsets
        values[..., self.columns] = found
        return bool(np.isfinite(found).all())


def followers(joints: Iterable[Joint], given: Collection[str], columns: Mapping[str, int]
              ) -> MimicJoints:
    """
    Return the variables that follow the given ones, directly or through other followers.

    A variable that is given itself does not follow another one, because it was measured.

    :param given: the names of the given variables.
    :param columns: the index of each variable, by name.
    """
    leaders = frozenset(given)
    found = [(columns[name], columns[mimic.joint], mimic.multiplier, mimic.offset)
             for name, mimic in _resolved(joints, leaders).items()
             if mimic.joint in leaders and mimic.joint != name]
    parts = list(zip(*found, strict=True)) or [()] * 4
    return MimicJoints(np.array(parts[0], np.intp), np.array(parts[1], np.intp),
                       np.array(parts[2], float), np.array(parts[3], float))


def _resolved(joints: Iterable[Joint], leaders: Collection[str] = ()) -> dict[str, Mimic]:
    """
    Return, for each follower, the last joint of its chain and the total multiplier and offset.

    :param joints: without cycles.
    :param leaders: joints that end a chain even if they mimic another joint.
    """
    mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
    known = {name: Mimic(name, 1.0, 0.0) for name in mimics if name in leaders}
    for name in mimics:
        chain = [name]  # the joints whose last joint is not known yet
        while chain[-1] in mimics and chain[-1] not in known:
            chain.append(mimics[chain[-1]].joint)
        last = chain.pop()
        leader, multiplier, offset = known.get(last, Mimic(last, 1.0, 0.0))
        for follower in reversed(chain):
            step = mimics[follower]
            offset = step.multiplier * offset + step.offset
            multiplier *= step.multiplier
            known[follower] = Mimic(leader, multiplier, offset)
    return known


def check_mimics(joints: Sequence[tuple[Joint, Element]]) -> None:
    """
    Check that each joint that mimics another one can follow it.

    :raises DescriptionError: the other joint does not exist, is fixed, has several variables,
        or follows this joint; or a multiplier or an offset is too large.
    """
    by_name = {joint.name: joint for joint, _ in joints}
    mimics = [(joint.name, joint.mimic, written) for joint, element in joints
              if joint.mimic is not None and (written := element.first('mimic')) is not None]
    led: set[str] = set()
    for name, mimic, element in mimics:
        _check_leader(element, mimic.joint, by_name)
        _check_that_it_ends(element, name, by_name, led)
    resolved = _resolved(by_name.values())
    for name, _, element in mimics:
        _check_size(element, resolved[name])


def _check_that_it_ends(element: Element, name: str, joints: Mapping[str, Joint], led: set[str]
                        ) -> None:
    """Follow a chain to its last joint or to a joint in ``led``; add the chain to ``led``."""
    seen = {name: None}
    mimic = joints[name].mimic
    while mimic is not None and mimic.joint not in seen and mimic.joint not in led:
        seen[mimic.joint] = None
        mimic = joints[mimic.joint].mimic if mimic.joint in joints else None
    if mimic is not None and mimic.joint in seen:
        raise element.error(f'it mimics itself: {" -> ".join(map(quoted, seen))} -> '
                            f'{quoted(mimic.joint)}',
                            'remove one <mimic>, so that one joint leads')
    led.update(seen)


def _check_size(element: Element, mimic: Mimic) -> None:
    """Check the total multiplier and offset of a joint."""
    for what, value in (('multiplier', mimic.multiplier), ('offset', mimic.offset)):
        if not abs(value) <= _LARGEST:
            raise element.error(
                f'its {what} with respect to {quoted(mimic.joint)} is {value:g}, which is larger '
                f'than {_LARGEST:g}', f'write the {what} of a real mechanism')


def _check_leader(mimic: Element, name: str, joints: Mapping[str, Joint]) -> None:
    leader = joints.get(name)
    if leader is None:
        meant = nearest(name, joints)
        raise mimic.error(f'it mimics {quoted(name)}, but no joint has that name',
                          f'did you mean {quoted(meant)}?' if meant else
                          'name a joint of this description, or remove the <mimic>')
    if leader.joint_type == FIXED or len(leader.variables) > 1:
        raise mimic.error(f'it mimics {quoted(name)}, which is {leader.joint_type}',
                          'name a joint with one variable: revolute, continuous or prismatic')


# --- poses

Indices = npt.NDArray[np.intp]


class _Slides(NamedTuple):
    """Joints that slide: their rows, their columns, and directions (K, 3) in the parent."""

    rows: Indices
    columns: Indices
    directions: Array


class Motion:
    """
    The edges of some joints as functions of their variables.

    All joints of one kind are computed at once. If p is the rotation of a joint's origin and n
    its axis, then its rotation by an angle a is p (n sin(a/2), cos(a/2)), a quaternion product.
    p (n, 0) and p (0, 1) do not depend on a. Each joint therefore costs a sine, a cosine and two
    multiplications of a quaternion by a number.

    :ivar variables: the names of all joints' variables: the columns of the argument of
        ``poses``.
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        """
        Compute the constant parts.

        :param joints: the rows of the result of ``poses``.
        """
        self.variables = tuple(name for joint in joints for name in joint.variables)
        self._columns = {name: column for column, name in enumerate(self.variables)}
        self._origins = np.array([joint.origin for joint in joints], float).reshape(-1, 7)
        # A planar joint slides twice, and numpy's += adds to each indexed row only once.
        self._slides = [slides for slides in (
            self._sliding(joints, PRISMATIC, PLANAR, part=0), self._sliding(joints, PLANAR, part=1)
        ) if len(slides.rows)]
        self._turning, self._angles = self._places(joints, *_TURNING, PLANAR, part=-1)
        axes = np.array([(*joints[row].axis, 0.0) for row in self._turning]).reshape(-1, 4)
        self._cosine_parts = self._origins[self._turning, 3:]
        self._sine_parts = so3.multiply_many(self._cosine_parts, axes)
        self._floating, first = self._places(joints, FLOATING, part=0)
        self._floats = first[:, None] + np.arange(7)

    def _places(self, joints: Sequence[Joint], *joint_types: str,
                part: int) -> tuple[Indices, Indices]:
        """Return the rows of the joints of some kinds, and the columns of one variable of each."""
        places = [(row, self._columns[joint.variables[part]])
                  for row, joint in enumerate(joints) if joint.joint_type in joint_types]
        rows, columns = np.array(places, np.intp).reshape(-1, 2).T
        return rows, columns

    def _sliding(self, joints: Sequence[Joint], *joint_types: str, part: int) -> _Slides:
        rows, columns = self._places(joints, *joint_types, part=part)
        directions = np.array([_direction(joints[row], part) for row in rows]).reshape(-1, 3)
        return _Slides(rows, columns, so3.rotate_many(self._origins[rows, 3:], directions))

    def has_turns(self, values: Array) -> bool:
        """Return whether no floating joint has a zero quaternion; values as in ``poses``."""
        return not len(self._floats) or bool(
            values[..., self._floats[:, 3:]].any(axis=-1).all())

    def poses(self, values: Array) -> Array:
        """
        Return ``parent_T_child`` of each joint.

        :param values: (..., variables) metres and radians.
        :return: (..., joints, 7).
        """
        poses = np.empty((*values.shape[:-1], *self._origins.shape))
        poses[...] = self._origins
        for rows, columns, directions in self._slides:
            poses[..., rows, :3] += values[..., columns, None] * directions
        if len(self._turning):
            half = 0.5 * values[..., self._angles, None]
            poses[..., self._turning, 3:] = (
                np.sin(half) * self._sine_parts + np.cos(half) * self._cosine_parts)
        if len(self._floating):
            free = values[..., self._floats]
            free[..., 3:] /= np.linalg.norm(free[..., 3:], axis=-1, keepdims=True)
            poses[..., self._floating, :] = se3.compose_many(self._origins[self._floating], free)
        return poses


def _direction(joint: Joint, part: int) -> Vector3:
    """
    Return the direction in which a joint slides, in the child's frame.

    A planar joint slides along x and y after the shortest rotation that takes z to its normal,
    and along x and y themselves if the normal is z.
    """
    if joint.joint_type == PRISMATIC:
        return joint.axis
    x, y, z = joint.axis
    # That rotation is (z cross normal, 1 + z . normal), normalised. If the normal is -z, take
    # half a turn about x.
    turn = so3.normalize((-y, x, 0.0, 1.0 + z)) if z > -1.0 else (1.0, 0.0, 0.0, 0.0)
    return so3.rotate(turn, (1.0, 0.0, 0.0) if part == 0 else (0.0, 1.0, 0.0))
