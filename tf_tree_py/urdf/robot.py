# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A robot: its links, its joints, and the pose of each link in its parent.

Links and joints form one tree: one root, one parent for each link, no loop.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
import re

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.text import known_names, nearest

from .joints import check_mimics, FIXED, followers, Joint, joint_of, Motion
from .robot_xml import Element, listed, Place, quoted, read, without_space_before
from .visuals import materials_of, Visual, visuals_of
from .xacro_files import description_of


def root_of(robot: Element, links: Mapping[str, Element],
            joints: Sequence[tuple[Joint, Element]]) -> str:
    """
    Return the root: the link without a parent.

    :param links: by name.
    :raises DescriptionError: the links do not form one tree.
    """
    if not links:
        raise robot.error('it has no links', 'write at least one <link name="..."/>')
    above: dict[str, Joint] = {}
    for joint, element in joints:
        for end, link in (('parent', joint.parent), ('child', joint.child)):
            _check_that_it_exists(element.first(end) or element, end, link, links)
        if joint.child in above:
            raise element.error(
                f'its child {quoted(joint.child)} already has a parent, through the joint '
                f'{quoted(above[joint.child].name)}',
                'a link has one parent: remove one of the two joints')
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    elements = {joint.name: element for joint, element in joints}
    if len(roots) > 1:
        raise _two_roots(robot, roots, links)
    _check_that_none_is_in_a_loop(links, above, elements)
    return roots[0]


def _check_that_it_exists(element: Element, end: str, link: str,
                          links: Mapping[str, Element]) -> None:
    if link in links:
        return
    meant = nearest(link, links)
    raise element.error(f'its {end} {quoted(link)} is not a link of this description',
                        (f'did you mean {quoted(meant)}? Otherwise ' if meant else '')
                        + f'add <link name={_attribute(link)}/>')


def _two_roots(robot: Element, roots: Sequence[str], links: Mapping[str, Element]) -> Exception:
    found = listed(f'{quoted(root)} (line {links[root].line})' for root in roots)
    return robot.error(
        f'{len(roots)} links have no parent: {found}',
        'a tree has one root: make each of the others the child of a joint, such as one of '
        'type="fixed"')


def _check_that_none_is_in_a_loop(links: Mapping[str, Element], above: Mapping[str, Joint],
                                  elements: Mapping[str, Element]) -> None:
    """Check that the way up from each link does not lead back to it; visit each link once."""
    done: set[str] = set()
    for link in links:
        climbed: dict[str, Joint] = {}
        while link in above and link not in done and link not in climbed:
            climbed[link] = above[link]
            link = above[link].parent
        if link in climbed:
            names = [joint.name for joint in climbed.values()][list(climbed).index(link):]
            loop = sorted(map(elements.__getitem__, names), key=lambda element: element.line)
            found = listed(f'{quoted(joint.attributes["name"])} (line {joint.line})'
                           for joint in loop)
            raise loop[0].error(f'it is part of a loop, which has no root: {found}',
                                'reverse one of these joints, or remove it')
        done.update(climbed)


def _attribute(text: str) -> str:
    return quoted(text).replace("'", '"')


# --- the robot

Edge = tuple[str, str]


class Robot:
    """
    The content of a URDF: the links of a robot and the joints between them. Immutable.

    :ivar name: of the robot.
    :ivar root: the link without a parent.
    :ivar links: the shapes of each link, by name; empty if it has none.
    :ivar joints: all joints, in the order of the description.
    :ivar moving: the joints that are not fixed.
    :ivar motion: computes the poses of the moving joints.
    :ivar variables: the names of the positions that can be given, metres and radians: those of
        the moving joints that mimic no other joint; see ``Joint.variables``.
    :ivar columns: the index of each variable of the moving joints, by name.
    :ivar rest: (columns,) the values of these variables at rest.
    :ivar warnings: what is ignored in the description, such as a box without a size or the
        quaternion of an origin, one sentence each.
    """

    def __init__(self, name: str, root: str, links: Mapping[str, tuple[Visual, ...]],
                 joints: tuple[Joint, ...], warnings: tuple[str, ...] = ()) -> None:
        """Make a robot from checked parts; use ``load`` or ``parse`` instead."""
        self.warnings = warnings
        self.name, self.root, self.links, self.joints = name, root, links, joints
        self.moving = tuple(joint for joint in joints if joint.joint_type != FIXED)
        self.motion = Motion(self.moving)
        self.variables = tuple(
            name for joint in self.moving if joint.mimic is None for name in joint.variables)
        self.columns = {name: column for column, name in enumerate(self.motion.variables)}
        self.rest = np.array([value for joint in self.moving for value in joint.rest], float)

    @classmethod
    def load(cls, path: str | Path, arguments: Mapping[str, str] | None = None) -> 'Robot':
        """
        Return the robot that a file describes.

        :param path: of a URDF, or of a file that ends in .xacro, which the package xacro
            expands.
        :param arguments: of the xacro, such as ``{'prefix': 'left_'}``.
        :raises OSError: the file cannot be read.
        :raises DescriptionError: the description is invalid; the error names the line and what
            to do.
        """
        description = description_of(path, arguments)
        return cls.parse(description.text, str(path), description.places)

    @classmethod
    def parse(cls, text: str | bytes, text_name: str = 'the robot description',
              places: Sequence[Place] | None = None) -> 'Robot':
        """
        Return the robot that a text describes.

        :param text: a string, or bytes in UTF-8.
        :param text_name: the name of the text in errors.
        :param places: the file and line of each element, if the text was made from other files.
        :raises DescriptionError: the description is invalid; the error names the line and what
            to do.
        """
        warnings: list[str] = []
        element = read(without_space_before(text, text_name, warnings), text_name, places)
        if element.tag != 'robot':
            raise element.error(f'the outermost element is <{element.tag}>',
                                'a robot description is <robot name="..."> ... </robot>')
        name = element.attribute('name', 'give the robot a name')
        _check_version(element)
        links = _by_name(element, 'link')
        joints = [(joint_of(each, warnings), each) for each in _by_name(element, 'joint').values()]
        root = root_of(element, links, joints)
        check_mimics(joints)
        materials = materials_of(element, warnings)
        visuals = {name: visuals_of(link, materials, warnings) for name, link in links.items()}
        # On one line of the description, two shapes may have the same flaw.
        return cls(name, root, visuals, tuple(joint for joint, _ in joints),
                   tuple(dict.fromkeys(warnings)))

    def __repr__(self) -> str:
        return (f'<Robot {self.name!r}: {len(self.links)} links on {self.root!r}, '
                f'{len(self.moving)} of {len(self.joints)} joints move>')

    def edges(self, joint_positions: Mapping[str, npt.ArrayLike] | npt.ArrayLike | None = None
              ) -> dict[Edge, Array]:
        """
        Return the pose of each link in its parent, by (parent, child).

        :param joint_positions: a number or (N,) numbers for each variable, by name. Variables
            that are not given are at rest, or follow the joint that they mimic. Or an array
            (N, variables) or (variables,) with the columns of ``variables``. None: all joints
            are at rest. Metres and radians.
        :return: ``parent_T_child`` of each joint: (N, 7), or (7,) for one position.
        :raises InvalidArgumentException: a name is not a variable, a number is not finite, or
            an array has another shape.
        """
        values = self._values(joint_positions)
        many = values.shape[:-1]
        moving = dict(zip(self.moving, np.moveaxis(self.motion.poses(values), -2, 0),
                          strict=True))
        return {joint.edge: moving[joint] if joint in moving
                else np.broadcast_to(np.array(joint.origin), (*many, 7))
                for joint in self.joints}

    def _values(self, given: Mapping[str, npt.ArrayLike] | npt.ArrayLike | None) -> Array:
        """Return all variables (..., columns), including those of joints that mimic others."""
        named = given if isinstance(given, Mapping) else self._named(given)
        for name in named:
            if name not in self.columns:
                raise InvalidArgumentException(
                    f'{name!r} is not a variable of this robot. '
                    + known_names(name, tuple(self.columns)))
        try:
            arrays = np.broadcast_arrays(*(np.asarray(each, float) for each in named.values()))
        except (TypeError, ValueError) as error:
            raise InvalidArgumentException(
                'positions are numbers, or arrays of the same length for all variables: '
                + ', '.join(
                    f'{name} {np.shape(each)}' for name, each in named.items())) from error
        values = np.empty((*(arrays[0].shape if arrays else ()), len(self.columns)))
        values[...] = self.rest
        followers(self.moving, self.variables, self.columns).follow(values)
        for name, array in zip(named, arrays, strict=True):
            if not np.isfinite(array).all():
                raise InvalidArgumentException(f'a position of {name!r} is not finite')
            values[..., self.columns[name]] = array
        if not followers(self.moving, named, self.columns).follow(values):
            raise InvalidArgumentException(
                'a position is too large: the position of a joint that mimics it is not finite')
        if not self.motion.has_turns(values):
            raise InvalidArgumentException(
                'the quaternion of a floating joint is zero; for no rotation give 0 0 0 1')
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
                f'positions are an array (N, {len(self.variables)}) with a column for each of '
                f'robot.variables, or a dictionary by their names; not {np.shape(array)}')
        return dict(zip(self.variables, np.moveaxis(array, -1, 0), strict=True))


# Two integers, as the parsers of Jazzy and Kilted read them.
_VERSION_1_0 = re.compile(r'\s*\+?0*1\.\s*[-+]?0+\.?')


def _check_version(robot: Element) -> None:
    """
    Check the version of the format, as the parsers of Jazzy and Kilted do; by default it is 1.0.

    :raises DescriptionError: it is another one.
    """
    version = robot.attributes.get('version', '1.0')
    if not _VERSION_1_0.fullmatch(version):
        raise robot.error(
            f'<robot> has the version {quoted(version)}, but robot_state_publisher of Jazzy reads '
            'only 1.0', 'write version="1.0", or remove the attribute')


def _by_name(robot: Element, tag: str) -> dict[str, Element]:
    """
    Return the links or joints of a description by name.

    :raises DescriptionError: one has no name, or two have the same name.
    """
    found: dict[str, Element] = {}
    for element in robot.children_of(tag):
        name = element.attribute('name', f'give every {tag} a unique name')
        if name in found:
            raise element.error(f'there is another {tag} with this name in line '
                                f'{found[name].line}', 'rename one of the two')
        found[name] = element
    return found
