# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The links of a robot as triangles: boxes, cylinders, spheres and meshes.

The files of meshes are found, and read with their colours.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import unquote, urlparse

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Box, Cylinder, Mesh, Robot, Sphere, Visual

Color = tuple[float, float, float, float]

_SUFFIXES: Final = ('.stl', '.obj', '.dae')
_MATERIALS: Final = '.mtl'


class Triangles(NamedTuple):
    """
    Triangles of one colour.

    :ivar vertices: (V, 3) metres.
    :ivar faces: (F, 3) indices of vertices.
    :ivar color: red, green, blue and opacity, 0 to 1; None: the file has no colour.
    """

    vertices: Array
    faces: npt.NDArray[np.int64]
    color: Color | None


def _load_mesh(file: Path) -> list[Triangles]:
    """
    Return the triangles in a mesh file, grouped by colour.

    :raises ValueError: the format is not supported, or there are no triangles.
    """
    import trimesh
    if file.suffix.lower() not in _SUFFIXES:
        raise ValueError(f'only {", ".join(_SUFFIXES)} can be shown')
    loaded = trimesh.load(file, resolver=_materials_beside(file), process=False)
    parts = [_part_triangles(part) for part in (
        loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded])
        if len(getattr(part, 'faces', ()))]
    if not parts:
        raise ValueError('it contains no triangles')
    return parts


def _part_triangles(part: Any) -> Triangles:
    """Return the triangles of a mesh, with each vertex once."""
    color = _color_in(part)
    vertices, places = np.unique(np.asarray(part.vertices, np.float32), axis=0,
                                 return_inverse=True)
    faces = places.reshape(-1)[np.asarray(part.faces, np.int64)]
    return Triangles(vertices.astype(float), faces, color)


def _materials_beside(file: Path) -> Any:
    """
    Return an object that reads the files to which a mesh refers.

    A description may come from an untrusted source, so it must not be able to read any file.
    Only material files in the folder of the mesh or below it are read, and no pictures.
    """
    import trimesh

    class Materials(trimesh.resolvers.Resolver):

        def __init__(self) -> None:
            pass

        def get(self, name: str) -> bytes:
            wanted = (file.parent / str(name)).resolve()
            if wanted.suffix.lower() != _MATERIALS or file.parent.resolve() not in wanted.parents:
                raise FileNotFoundError(name)
            return wanted.read_bytes()

        def keys(self) -> list[str]:
            return []

        def write(self, name: str, data: bytes) -> None:
            raise NotImplementedError

        def namespaced(self, namespace: str) -> 'Materials':
            return self

    return Materials()


def _color_in(part: Any) -> Color | None:
    """Return the colour of a mesh's material, or else the mean colour of its vertices."""
    visual = part.visual
    material = getattr(visual, 'material', None)
    if material is not None:
        main = getattr(material, 'main_color', None)
        return None if main is None else _as_color(main)
    if getattr(visual, 'defined', False) and visual.kind in ('face', 'vertex'):
        return _as_color(np.asarray(visual.vertex_colors, float).mean(axis=0))
    return None


def _as_color(channels: npt.ArrayLike) -> Color:
    red, green, blue, opacity = (np.asarray(channels, float) / 255.0).tolist()
    # Some exporters write an opacity of 0 for a solid material.
    return red, green, blue, opacity or 1.0


def mesh_file(filename: str, path: Path) -> Path | None:
    """
    Return the mesh file that a description names; None if it does not exist.

    Packages are searched for among the installed ROS packages and in the folders above the
    description. Nothing is downloaded.

    :param filename: as the description writes it.
    :param path: of the description.
    """
    address = urlparse(filename)
    if address.scheme in ('package', 'model'):
        folders = _package(address.netloc, path)
        candidates = [folder / unquote(address.path).lstrip('/') for folder in folders]
    elif address.scheme in ('', 'file'):
        candidates = [path.parent / unquote(address.path)]
    else:
        return None
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _package(name: str, path: Path) -> Iterator[Path]:
    """Yield the folders in which a package may be."""
    try:
        from ament_index_python.packages import get_package_share_directory
        yield Path(get_package_share_directory(name))
    except (ImportError, LookupError, ValueError):
        pass  # there is no ROS, or the package is not installed
    for folder in path.resolve().parents:
        if folder.name == name:
            yield folder
        yield folder / name
        # Some packages contain the packages of several robots in this folder.
        yield folder / 'robots' / name


# --- links

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
        read[file] = _load_mesh(file)
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
