# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The links of a robot as triangles, and the search for the files of meshes."""

import numpy as np
import pytest
from tf_tree_py.urdf import Robot
from tf_tree_py.view.robot.shapes import mesh_file, shapes_of

trimesh = pytest.importorskip('trimesh', reason='meshes need trimesh')

# A future numpy will not allow an operation of pycollada.
pytestmark = pytest.mark.filterwarnings('ignore:Setting the shape:DeprecationWarning')

GEOMETRIES = {
    'box': '<box size="1 2 3"/>',
    'cylinder': '<cylinder radius="0.5" length="2"/>',
    'sphere': '<sphere radius="0.5"/>',
    'stl': '<mesh filename="package://my_robot/meshes/part.stl" scale="1 1 2"/>',
    'obj': '<mesh filename="../meshes/part.obj"/>',
    'dae': '<mesh filename="../meshes/part.dae"/>',
}
SIZES = {'box': (1, 2, 3), 'cylinder': (1, 1, 2), 'sphere': (1, 1, 1), 'stl': (1, 1, 2),
         'obj': (1, 1, 1), 'dae': (1, 1, 1)}


@pytest.fixture
def package(tmp_path):
    """Return a package with meshes of a box of one metre, and a folder for descriptions."""
    package = tmp_path / 'my_robot'
    (package / 'urdf').mkdir(parents=True)
    (package / 'meshes').mkdir()
    for suffix in ('stl', 'obj', 'dae'):
        trimesh.creation.box((1, 1, 1)).export(package / 'meshes' / f'part.{suffix}')
    return package


def described(package, geometry):
    path = package / 'urdf' / 'robot.urdf'
    path.write_text(f"""<robot name="one"><link name="base"><visual>
      <origin xyz="10 0 0" rpy="0 0 1.5707963267948966"/><geometry>{geometry}</geometry>
      <material name=""><color rgba="1 0 0 0.5"/></material>
    </visual></link></robot>""")
    return shapes_of(Robot.load(path), path)


@pytest.mark.parametrize('geometry', GEOMETRIES)
def test_shape_has_its_size_and_stands_at_its_origin(package, geometry):
    (shape,), missing = described(package, GEOMETRIES[geometry])
    assert missing == []
    assert (shape.link, shape.color) == ('base', (1.0, 0.0, 0.0, 0.5))
    x, y, z = SIZES[geometry]
    np.testing.assert_allclose(np.ptp(shape.vertices, axis=0), (y, x, z), rtol=0.03)
    np.testing.assert_allclose((shape.vertices.min(axis=0) + shape.vertices.max(axis=0)) / 2.0,
                               (10.0, 0.0, 0.0), atol=1e-6)
    assert shape.faces.max() < len(shape.vertices)


@pytest.mark.parametrize(('filename', 'why'), [
    ('package://my_robot/meshes/none.stl', 'the file does not exist'),
    ('package://nobody/part.stl', 'the file does not exist'),
    ('http://127.0.0.1:9/part.stl', 'the file does not exist'),
    ('../urdf/robot.urdf', 'only .stl, .obj, .dae can be shown'),
    ('../meshes/broken.stl', ''),
])
def test_mesh_that_cannot_be_had_is_told_and_the_rest_is_shown(package, filename, why):
    (package / 'meshes' / 'broken.stl').write_bytes(b'solid\xff\x00nothing')
    shapes, (sentence,) = described(package, f'<mesh filename="{filename}"/>')
    assert shapes == []
    assert sentence.startswith(f'mesh {filename} is not shown: ') and why in sentence


def test_colours_of_a_mesh_are_its_own(package):
    box = trimesh.creation.box((1, 1, 1))
    material = trimesh.visual.material.SimpleMaterial(diffuse=(0, 255, 0, 255))
    box.visual = trimesh.visual.TextureVisuals(material=material)
    box.export(package / 'meshes' / 'green.obj')
    box.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(
        baseColorFactor=(0, 0, 255, 255)))
    box.export(package / 'meshes' / 'blue.dae')
    for name, colour in (('green.obj', (0, 1, 0)), ('blue.dae', (0, 0, 1))):
        (shape,), missing = described(package, f'<mesh filename="../meshes/{name}"/>')
        assert missing == []
        np.testing.assert_allclose(shape.color[:3], colour, atol=0.01)


def test_material_outside_of_the_folder_is_not_read(package):
    (package / 'secret.mtl').write_text('newmtl m\nKd 0 1 0\n')
    (package / 'meshes' / 'bad.obj').write_text(
        'mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n')
    (shape,), _ = described(package, '<mesh filename="../meshes/bad.obj"/>')
    assert shape.color[:3] != (0.0, 1.0, 0.0)


def test_file_address_and_spaces_are_understood(package):
    part = package / 'meshes' / 'my part.stl'
    part.touch()
    assert mesh_file(f'file://{package}/meshes/my%20part.stl', package / 'robot.urdf') == part
