# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Launch files and the RViz configuration, as far as they can be tested without both programs.

A stand-in for ``launch`` has the used names, and records their arguments. Where the real one is
installed, it also loads the files.
"""

from pathlib import Path
import runpy
import sys
from types import ModuleType

import pytest
from tf_tree_py.nodes import five_frame_listener, five_frame_publisher, urdf_broadcaster
from tf_tree_py.nodes.five_frame_motion import Frames
import yaml

REPOSITORY = Path(__file__).parents[2]
FILES = sorted((REPOSITORY / 'launch').glob('*.launch.py'))
STAND_IN = {
    'launch': ['LaunchDescription'],
    'launch.actions': ['DeclareLaunchArgument', 'IncludeLaunchDescription'],
    'launch.conditions': ['IfCondition'],
    'launch.launch_description_sources': ['PythonLaunchDescriptionSource'],
    'launch.substitutions': ['LaunchConfiguration', 'PathJoinSubstitution'],
    'launch_ros': [],
    'launch_ros.actions': ['Node'],
    'launch_ros.parameter_descriptions': ['ParameterValue'],
    'launch_ros.substitutions': ['FindPackageShare'],
}


class Made:
    """An object of the stand-in, and its arguments."""

    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs

    def all_within(self, kind):
        """Yield all objects of a kind in this one, at any depth."""
        todo = [self]
        while todo:
            thing = todo.pop(0)
            if isinstance(thing, Made):
                if type(thing).__name__ == kind:
                    yield thing
                todo += [thing.args, thing.kwargs]
            elif isinstance(thing, dict):
                todo += thing.values()
            elif isinstance(thing, list | tuple):
                todo += thing


@pytest.fixture
def load(monkeypatch):
    """Return a function that loads a launch file with the stand-in."""
    for name, classes in STAND_IN.items():
        module = ModuleType(name)
        for class_name in classes:
            setattr(module, class_name, type(class_name, (Made,), {}))
        monkeypatch.setitem(sys.modules, name, module)
    return lambda path: runpy.run_path(str(path))['generate_launch_description']()


def of_this_package(description):
    return [node for node in description.all_within('Node')
            if node.kwargs['package'] == 'tf_tree_py']


def test_there_is_one_for_each_and_one_for_both():
    assert [path.name for path in FILES] == [
        'five_frame_listener.launch.py', 'five_frame_publisher.launch.py', 'five_frames.launch.py',
        'urdf_broadcaster.launch.py']


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_arguments_are_declared_and_described(load, path):
    description = load(path)
    declared = [made.args[0] for made in description.all_within('DeclareLaunchArgument')]
    used = {made.args[0] for made in description.all_within('LaunchConfiguration')}
    assert {'params_file', 'use_sim_time', 'namespace'} <= set(declared)
    assert used == set(declared)
    for argument in description.all_within('DeclareLaunchArgument'):
        assert argument.kwargs['description']
        assert 'default_value' in argument.kwargs


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_files_of_this_package_that_are_named_exist(load, path):
    for made in load(path).all_within('PathJoinSubstitution'):
        share, *parts = made.args[0]
        assert share.args == ('tf_tree_py',)
        assert REPOSITORY.joinpath(*parts).is_file()


@pytest.mark.parametrize('module', [
    five_frame_publisher, five_frame_listener, urdf_broadcaster])
def test_node_goes_by_the_arguments(load, module):
    node, = of_this_package(load(REPOSITORY / 'launch' / f'{module.NAME}.launch.py'))
    assert node.kwargs['executable'] == module.NAME
    # config/five_frames.yaml addresses the node by this name.
    assert node.kwargs['name'] == module.NAME
    assert node.kwargs['namespace'].args == ('namespace',)
    file, values = node.kwargs['parameters']
    assert file.args == ('params_file',)
    assert values['use_sim_time'].args[0].args == ('use_sim_time',)
    assert values['use_sim_time'].kwargs == {'value_type': bool}


def test_launch_file_for_both_includes_both_with_its_arguments(load):
    includes = list(load(REPOSITORY / 'launch' / 'five_frames.launch.py').all_within(
        'IncludeLaunchDescription'))
    assert [next(made.all_within('PathJoinSubstitution')).args[0][-1] for made in includes] == [
        'five_frame_publisher.launch.py', 'five_frame_listener.launch.py']
    for made in includes:
        passed = {name: value.args[0] for name, value in made.kwargs['launch_arguments']}
        assert passed == {name: name for name in ('params_file', 'use_sim_time', 'namespace')}


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_launch_itself_takes_the_files(path):
    pytest.importorskip('launch_ros')
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    assert get_launch_description_from_python_launch_file(str(path)).entities


def test_rviz_shows_the_five_frames_on_a_grid():
    config = yaml.safe_load((REPOSITORY / 'rviz' / 'five_frames.rviz').read_text())
    manager = config['Visualization Manager']
    displays = {display['Class']: display for display in manager['Displays']}
    assert displays.keys() == {'rviz_default_plugins/Grid', 'rviz_default_plugins/TF'}
    assert all(display['Enabled'] and display['Value'] for display in displays.values())
    frames = displays['rviz_default_plugins/TF']['Frames']
    assert frames.keys() == {'All Enabled', *Frames()}
    assert manager['Global Options']['Fixed Frame'] == Frames().world
