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

"""What a link looks like, kept as data: nothing is drawn here, and no mesh is looked for."""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

from tf_tree_py.core.geometry.pose import Pose

from .elements import Element
from .values import numbers, origin_of, positive

Color: TypeAlias = tuple[float, float, float, float]


class Box(NamedTuple):
    """A box about its origin: its lengths along x, y and z, metres."""

    size: tuple[float, float, float]


class Cylinder(NamedTuple):
    """A cylinder about its origin, along z: metres."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """A sphere about its origin: metres."""

    radius: float


class Mesh(NamedTuple):
    """
    A mesh in a file.

    :ivar filename: as it is written: a path, ``file://`` or ``package://``.
    :ivar scale: along x, y and z.
    """

    filename: str
    scale: tuple[float, float, float]


Shape: TypeAlias = Box | Cylinder | Sphere | Mesh


class Visual(NamedTuple):
    """
    One shape of a link.

    :ivar origin: ``link_T_shape``.
    :ivar color: red, green, blue and opacity, 0 to 1; None: none was said.
    """

    shape: Shape
    origin: Pose
    color: Color | None


def materials_of(robot: Element) -> dict[str, Color]:
    """Return the colours that a description names for all links."""
    colors = {material.attributes.get('name', ''): _color_in(material)
              for material in robot.children_of('material')}
    return {name: color for name, color in colors.items() if color is not None}


def visuals_of(link: Element, materials: Mapping[str, Color]) -> tuple[Visual, ...]:
    """
    Return the shapes of a link; those of a kind that is not known are left out.

    :raises DescriptionError: a shape has no size, or a number is none.
    """
    visuals = []
    for element in link.children_of('visual'):
        shape = _shape_of(element)
        if shape is not None:
            visuals.append(Visual(shape, origin_of(element), _color_of(element, materials)))
    return tuple(visuals)


def _shape_of(visual: Element) -> Shape | None:
    geometry = visual.first('geometry')
    if geometry is None or not geometry.children:
        raise visual.error('<visual> has no geometry', 'give it one, such as '
                           '<geometry><box size="1 1 1"/></geometry>, or take it out')
    shape = geometry.children[0]
    if shape.tag == 'box':
        x, y, z = positive(shape, 'size', 3)
        return Box((x, y, z))
    if shape.tag == 'cylinder':
        return Cylinder(*positive(shape, 'radius'), *positive(shape, 'length'))
    if shape.tag == 'sphere':
        return Sphere(*positive(shape, 'radius'))
    if shape.tag == 'mesh':
        # A scale may be negative: it turns a left-handed mesh round.
        x, y, z = numbers(shape, 'scale', (1.0, 1.0, 1.0))
        return Mesh(shape.attribute('filename', 'name the file of the mesh'), (x, y, z))
    return None


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
