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

"""A robot: its links, its joints, and where every link is in its parent."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.suggest import known_names

from .elements import Element, read
from .expanding import text_of
from .following import check_mimics, followers
from .hanging import root_of
from .joints import FIXED, Joint, joint_of
from .motion import Motion
from .visuals import materials_of, Visual, visuals_of

Edge = tuple[str, str]


class Robot:
    """
    What a URDF says: which link hangs on which, and how it moves there. Never changes.

    :ivar name: the robot's.
    :ivar root: the link on which all others hang.
    :ivar links: what each link looks like; empty of one that looks like nothing.
    :ivar joints: each of them, as they are written.
    :ivar moving: those that move.
    :ivar variables: what positions there are to give, metres and radians: of every joint
        that moves and mimics nobody; see ``Joint.variables``.
    """

    def __init__(self, name: str, root: str, links: Mapping[str, tuple[Visual, ...]],
                 joints: tuple[Joint, ...]) -> None:
        """Take what was read and checked; ``load`` and ``parse`` do that."""
        self.name, self.root, self.links, self.joints = name, root, links, joints
        self.moving = tuple(joint for joint in joints if joint.kind != FIXED)
        self.motion = Motion(self.moving)
        self.variables = tuple(
            name for joint in self.moving if joint.mimic is None for name in joint.variables)
        self.columns = {name: column for column, name in enumerate(self.motion.variables)}
        self.rest = np.array([value for joint in self.moving for value in joint.rest], float)

    @classmethod
    def load(cls, path: str | Path) -> 'Robot':
        """
        Return the robot that a file describes.

        :param path: URDF, or a file that ends in .xacro, which the package xacro expands.
        :raises OSError: it cannot be read.
        :raises DescriptionError: it describes none; the error names the line and the mend.
        """
        return cls.parse(text_of(path), str(path))

    @classmethod
    def parse(cls, text: str | bytes, source: str = 'the robot description') -> 'Robot':
        """
        Return the robot that a text describes.

        :param text: a string, or bytes of UTF-8.
        :param source: what errors call the text.
        :raises DescriptionError: it describes none; the error names the line and the mend.
        """
        element = read(text, source)
        if element.tag != 'robot':
            raise element.error(f'the outermost element is <{element.tag}>',
                                'a robot description is <robot name="..."> ... </robot>')
        name = element.attribute('name', 'give the robot one')
        links = _by_name(element, 'link')
        joints = [(joint_of(each), each) for each in _by_name(element, 'joint').values()]
        root = root_of(element, links, joints)
        check_mimics(joints)
        materials = materials_of(element)
        return cls(name, root, {name: visuals_of(link, materials) for name, link in links.items()},
                   tuple(joint for joint, _ in joints))

    def __repr__(self) -> str:
        return (f'<Robot {self.name!r}: {len(self.links)} links on {self.root!r}, '
                f'{len(self.moving)} of {len(self.joints)} joints move>')

    def edges(self, joint_positions: Mapping[str, npt.ArrayLike] | npt.ArrayLike | None = None
              ) -> dict[Edge, Array]:
        """
        Return where every link is in its parent, by (parent, child).

        :param joint_positions: by variable, a number or (N,) numbers each: what is not given
            is at rest or follows whom it mimics; or an array (N, variables) or (variables,)
            with the columns of ``variables``; None: at rest. Metres and radians.
        :return: ``parent_T_child`` of each joint: (N, 7), or (7,) for one position.
        :raises InvalidArgumentException: a name that is no variable, numbers that are not
            finite, or another shape.
        """
        values = self._values(joint_positions)
        many = values.shape[:-1]
        moving = dict(zip(self.moving, np.moveaxis(self.motion.poses(values), -2, 0),
                          strict=True))
        return {joint.edge: moving[joint] if joint in moving
                else np.broadcast_to(np.array(joint.origin), (*many, 7))
                for joint in self.joints}

    def _values(self, given: Any) -> Array:
        """Return all variables (..., columns), those of joints that mimic too."""
        named = given if isinstance(given, Mapping) else self._named(given)
        for name in named:
            if name not in self.columns:
                raise InvalidArgumentException(
                    f'{name!r} is no variable of this robot. '
                    + known_names(name, tuple(self.columns)))
        try:
            arrays = np.broadcast_arrays(*(np.asarray(each, float) for each in named.values()))
        except (TypeError, ValueError) as error:
            raise InvalidArgumentException(
                'positions are numbers, or as many for each variable: ' + ', '.join(
                    f'{name} {np.shape(each)}' for name, each in named.items())) from error
        values = np.empty((*(arrays[0].shape if arrays else ()), len(self.columns)))
        values[...] = self.rest
        followers(self.moving, self.variables, self.columns).follow(values)
        for name, array in zip(named, arrays, strict=True):
            if not np.isfinite(array).all():
                raise InvalidArgumentException(f'a position of {name!r} is not finite')
            values[..., self.columns[name]] = array
        followers(self.moving, named, self.columns).follow(values)
        if not self.motion.has_turns(values):
            raise InvalidArgumentException(
                'the quaternion of a floating joint is all zero; for no rotation give 0 0 0 1')
        return values

    def _named(self, given: npt.ArrayLike | None) -> dict[str, Array]:
        if given is None:
            return {}
        try:
            array = np.asarray(given, float)
        except (TypeError, ValueError):
            array = np.empty(())
        if array.shape[-1:] != (len(self.variables),):
            raise InvalidArgumentException(
                f'positions are (N, {len(self.variables)}), a column for each of '
                f'robot.variables, or a dictionary by their names; not {np.shape(array)}')
        return dict(zip(self.variables, np.moveaxis(array, -1, 0), strict=True))


def _by_name(robot: Element, kind: str) -> dict[str, Element]:
    """
    Return the links or joints of a description by their names.

    :raises DescriptionError: one has no name, or two have the same.
    """
    found: dict[str, Element] = {}
    for element in robot.children_of(kind):
        name = element.attribute('name', f'give every {kind} a name of its own')
        if name in found:
            raise element.error(f'there is another {kind} of this name, in line '
                                f'{found[name].line}', 'rename one of the two')
        found[name] = element
    return found
