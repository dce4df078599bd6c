# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The links of a robot as triangles: boxes, cylinders, spheres and meshes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Box, Cylinder, Mesh, Robot, Sphere, Visual

from .mesh_files import Color, load_mesh, mesh_file, Triangles

_GREY: Final = (0.7, 0.7, 0.7, 1.0)


class LinkShape(NamedTuple):
    """
    One shape of a link.

    :ivar vertices: (V, 3) in the link's frame, metres.
    :ivar faces: (F, 3) indices of vertices.
    :ivar color: red, green, blue and opacity, 0 to 1.
    """

    link: str
    vertices: Array
    faces: npt.NDArray[np.int64]
    color: Color


def shapes_of(robot: Robot, path: Path) -> tuple[list[LinkShape], list[str]]:
    """
    Return the shapes of a robot's links, and one sentence for each shape that is missing.

    A mesh has the colour of its file, as in RViz, or else the colour in the description.

    :param path: of the description. Relative file names of meshes start from its folder.
    """
    shapes: list[LinkShape] = []
    missing: dict[str, None] = {}
    read: dict[Path, list[Triangles]] = {}
    for link, visual in _visuals(robot):
        try:
            parts = _triangles(visual, path, read)
        # The readers of meshes raise many kinds of errors for damaged files.
        except Exception as error:  # noqa: B902
            missing[f'{_name(visual)} is not shown: {error}'] = None
            continue
        shapes += [LinkShape(link, visual.origin @ part.vertices, part.faces,
                             _color_of(part, visual)) for part in parts]
    return shapes, list(missing)


def _color_of(part: Triangles, visual: Visual) -> Color:
    """Return the colour of a part of a mesh, or else the one in the description."""
    own, described = part.color, visual.color
    # Exporters write black for no colour.
    if own is None or (described is not None and not any(own[:3])):
        return described or own or _GREY
    return own


def _visuals(robot: Robot) -> Iterator[tuple[str, Visual]]:
    for link, visuals in robot.links.items():
        for visual in visuals:
            yield link, visual


def _name(visual: Visual) -> str:
    shape = visual.shape
    return f'mesh {shape.filename}' if isinstance(shape, Mesh) else 'a shape'


def _triangles(visual: Visual, path: Path, read: dict[Path, list[Triangles]]) -> list[Triangles]:
    """
    Return the triangles of a shape.

    :param read: the triangles of the files that have been read; new files are added.
    """
    shape = visual.shape
    if not isinstance(shape, Mesh):
        solid = _solid(shape)
        return [Triangles(np.asarray(solid.vertices, float), np.asarray(solid.faces, np.int64),
                          None)]
    file = mesh_file(shape.filename, path)
    if file is None:
        raise FileNotFoundError('the file does not exist')
    if file not in read:
        read[file] = load_mesh(file)
    # A reflection turns triangles inside out.
    order = slice(None, None, -1) if np.prod(shape.scale) < 0.0 else slice(None)
    return [part._replace(vertices=part.vertices * shape.scale, faces=part.faces[:, order])
            for part in read[file]]


def _solid(shape: Box | Cylinder | Sphere) -> Any:
    import trimesh
    if isinstance(shape, Box):
        return trimesh.creation.box(shape.size)
    if isinstance(shape, Cylinder):
        return trimesh.creation.cylinder(shape.radius, shape.length, sections=32)
    return trimesh.creation.icosphere(3, shape.radius)
