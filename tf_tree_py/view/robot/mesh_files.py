# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finds the files of meshes and reads their triangles and colours."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import unquote, urlparse

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

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


def load_mesh(file: Path) -> list[Triangles]:
    """
    Return the triangles in a mesh file, grouped by colour.

    :raises ValueError: the format is not supported, or there are no triangles.
    """
    import trimesh
    if file.suffix.lower() not in _SUFFIXES:
        raise ValueError(f'only {", ".join(_SUFFIXES)} can be shown')
    loaded = trimesh.load(file, resolver=_materials_beside(file), process=False)
    parts = [_triangles(part) for part in (
        loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded])
        if len(getattr(part, 'faces', ()))]
    if not parts:
        raise ValueError('it contains no triangles')
    return parts


def _triangles(part: Any) -> Triangles:
    """Return the triangles of a mesh, with each vertex once."""
    color = _color_of(part)
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


def _color_of(part: Any) -> Color | None:
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
