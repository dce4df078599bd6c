# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The shapes of links as data. This module does not draw, and it does not read meshes."""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

from tf_tree_py.core.geometry.pose import Pose

from .robot_xml import DescriptionError, Element, numbers, origin_of, positive

Color: TypeAlias = tuple[float, float, float, float]


class Box(NamedTuple):
    """A box with its centre at the origin: its lengths along x, y and z, metres."""

    size: tuple[float, float, float]


class Cylinder(NamedTuple):
    """A cylinder along z with its centre at the origin, metres."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """A sphere with its centre at the origin, metres."""

    radius: float


class Mesh(NamedTuple):
    """
    A mesh in a file.

    :ivar filename: as in the description: a path, ``file://`` or ``package://``.
    :ivar scale: factors along x, y and z.
    """

    filename: str
    scale: tuple[float, float, float]


_Shape: TypeAlias = Box | Cylinder | Sphere | Mesh


class Visual(NamedTuple):
    """
    One shape of a link.

    :ivar origin: ``link_T_shape``.
    :ivar color: red, green, blue and opacity, 0 to 1; None: the description has no colour.
    """

    shape: _Shape
    origin: Pose
    color: Color | None


def materials_of(robot: Element, warnings: list[str]) -> dict[str, Color]:
    """
    Return the named colours that all links of a description can use.

    :param warnings: a sentence is added for each colour that cannot be read.
    """
    colors = {}
    for material in robot.children_of('material'):
        try:
            color = _color_in(material)
        except DescriptionError as error:
            warnings.append(str(error))
            continue
        if color is not None:
            colors[material.attributes.get('name', '')] = color
    return colors


def visuals_of(link: Element, materials: Mapping[str, Color],
               warnings: list[str]) -> tuple[Visual, ...]:
    """
    Return the shapes of a link, without those of an unknown kind.

    :param materials: the named colours of the description.
    :param warnings: a sentence is added for each shape that is unknown or cannot be read, which
        transforms do not need, and for an attribute that is ignored.
    """
    visuals = []
    for element in link.children_of('visual'):
        try:
            visuals.append(Visual(_shape_of(element), origin_of(element, warnings),
                                  _color_of(element, materials)))
        except DescriptionError as error:
            warnings.append(f'{error} (the shape is not shown; transforms do not need it)')
    return tuple(visuals)


def _shape_of(visual: Element) -> _Shape:
    geometry = visual.first('geometry')
    if geometry is None or not geometry.children:
        raise visual.error('<visual> has no geometry', 'add one, such as '
                           '<geometry><box size="1 1 1"/></geometry>, or remove the <visual>')
    shape = geometry.children[0]
    if shape.tag == 'box':
        x, y, z = positive(shape, 'size', 3)
        return Box((x, y, z))
    if shape.tag == 'cylinder':
        return Cylinder(*positive(shape, 'radius'), *positive(shape, 'length'))
    if shape.tag == 'sphere':
        return Sphere(*positive(shape, 'radius'))
    if shape.tag == 'mesh':
        # A scale may be negative, which reflects the mesh.
        x, y, z = numbers(shape, 'scale', (1.0, 1.0, 1.0))
        return Mesh(shape.attribute('filename', 'write the file name of the mesh'), (x, y, z))
    raise shape.error(f'<{shape.tag}> is not a shape of URDF 1.0',
                      'write a <box>, a <cylinder>, a <sphere> or a <mesh>')


def _color_of(visual: Element, materials: Mapping[str, Color]) -> Color | None:
    material = visual.first('material')
    if material is None:
        return None
    return _color_in(material) or materials.get(material.attributes.get('name', ''))


def _color_in(material: Element) -> Color | None:
    color = material.first('color')
    if color is None:
        return None
    red, green, blue, opacity = numbers(color, 'rgba', (0.0, 0.0, 0.0, 1.0))
    return red, green, blue, opacity
