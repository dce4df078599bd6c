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

"""The links of a robot as triangles: boxes, cylinders, spheres, and meshes that are found."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import unquote, urlparse

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Box, Cylinder, Mesh, Robot, Sphere, Visual

_GREY: Final = (0.7, 0.7, 0.7, 1.0)
_SUFFIXES: Final = ('.stl', '.obj', '.dae')


class LinkShape(NamedTuple):
    """
    One shape of a link.

    :ivar vertices: (V, 3) in the link's frame, metres.
    :ivar faces: (F, 3) which vertices.
    :ivar color: red, green, blue and opacity, 0 to 1.
    """

    link: str
    vertices: Array
    faces: npt.NDArray[np.int64]
    color: tuple[float, float, float, float]


def shapes_of(robot: Robot, path: Path) -> tuple[list[LinkShape], list[str]]:
    """
    Return the shapes of a robot's links, and what could not be had, a sentence each.

    :param path: of the description; meshes are looked for from there.
    """
    shapes: list[LinkShape] = []
    missing: dict[str, None] = {}
    for link, visual in _visuals(robot):
        try:
            triangles = _triangles(visual, path)
        # Readers of meshes raise whatever their files make them raise.
        except Exception as error:  # noqa: B902
            missing[f'{_name(visual)} is not shown: {error}'] = None
            continue
        vertices = np.asarray(triangles.vertices, float)
        shapes.append(LinkShape(link, visual.origin @ vertices,
                                np.asarray(triangles.faces, np.int64), visual.color or _GREY))
    return shapes, list(missing)


def _visuals(robot: Robot) -> Iterator[tuple[str, Visual]]:
    for link, visuals in robot.links.items():
        for visual in visuals:
            yield link, visual


def _name(visual: Visual) -> str:
    shape = visual.shape
    return f'mesh {shape.filename}' if isinstance(shape, Mesh) else 'a shape'


def _triangles(visual: Visual, path: Path) -> Any:
    import trimesh
    shape = visual.shape
    if isinstance(shape, Box):
        return trimesh.creation.box(shape.size)
    if isinstance(shape, Cylinder):
        return trimesh.creation.cylinder(shape.radius, shape.length, sections=24)
    if isinstance(shape, Sphere):
        return trimesh.creation.icosphere(2, shape.radius)
    file = mesh_file(shape.filename, path)
    if file is None:
        raise FileNotFoundError('no such file is there')
    if file.suffix.lower() not in _SUFFIXES:
        raise ValueError(f'only {", ".join(_SUFFIXES)} can be shown')
    # Materials name other files, which a description could use to have any file read.
    triangles: Any = trimesh.load(file, force='mesh', skip_materials=True)
    if not len(getattr(triangles, 'faces', ())):
        raise ValueError('it holds no triangle')
    triangles.apply_scale(shape.scale)
    return triangles


def mesh_file(filename: str, path: Path) -> Path | None:
    """
    Return the file that a description names; None where it is not there.

    A package is looked for where ROS has it installed, and in the folders above the
    description. Nothing is fetched from anywhere.
    """
    address = urlparse(filename)
    if address.scheme == 'package':
        folders = _package(address.netloc, path)
        candidates = [folder / unquote(address.path).lstrip('/') for folder in folders]
    elif address.scheme in ('', 'file'):
        candidates = [path.parent / unquote(address.path)]
    else:
        return None
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _package(name: str, path: Path) -> Iterator[Path]:
    """Yield where a package may be."""
    try:
        from ament_index_python.packages import get_package_share_directory
        yield Path(get_package_share_directory(name))
    except (ImportError, LookupError, ValueError):
        pass  # without ROS, or not installed there
    for folder in path.resolve().parents:
        if folder.name == name:
            yield folder
        yield folder / name
