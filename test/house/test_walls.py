# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Imports have one direction, between the layers and inside them."""

import ast
from collections import Counter
import graphlib
from importlib.util import find_spec
from pathlib import Path
import re
import subprocess
import sys

import house
from programs import PATIENCE_S
import pytest
import tf_tree_py

PACKAGE = Path(tf_tree_py.__file__).parent
TESTS = Path(__file__).parents[1]

# Layers without ROS, and the packages that they may need besides the standard library.
WITHOUT_ROS = {layer: set(of.needs.split()) for layer, of in house.LAYERS.items()
               if of.needs is not None}


def named(path):
    return '/'.join(path.relative_to(house.PACKAGE).parts)


def test_every_layer_and_room_is_in_the_table():
    assert {house.parts(path)[0] for path in house.files()} == set(house.LAYERS)
    for layer, of in house.LAYERS.items():
        folders = {path.parent.name for path in house.files()
                   if path.parent.parent == house.PACKAGE / layer}
        assert folders == set(of.rooms.split()), layer


def test_core_is_read_in_an_afternoon_and_no_file_is_long():
    sizes = {named(path): house.size_of(path) for path in house.files()}
    core = [size.code for name, size in sizes.items() if name.startswith('core/')]
    assert len(core) <= 41 and sum(core) <= 4200, (
        f'core has {sum(core):,} lines in {len(core)} files; docs/heart.md promises at most 4,200 '
        'in 41: move code to a layer above, or change the numbers in docs/heart.md, '
        'docs/index.md, README.md and here')
    assert [name for name, size in sizes.items() if size.lines > 450] == []


def test_c_is_one_short_file():
    [file] = house.PACKAGE.rglob('*.c')
    code = re.sub(r'/\*.*?\*/', '', file.read_text(), flags=re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 250


# Folders of tests of something else than a layer: the whole package, and what is beside it.
OTHER_TESTS = {'house', 'arm', 'docs', 'jazzy', 'data'}


def test_folders_of_tests_are_those_of_layers_and_rooms():
    folders = {path.parent.relative_to(TESTS).parts for path in TESTS.rglob('test_*.py')}
    layers = {folder[0] for folder in folders if folder}
    assert layers - OTHER_TESTS <= house.LAYERS.keys()
    for layer, *room in filter(None, folders):
        assert not room or set(room) <= set(house.LAYERS[layer].rooms.split()), (layer, room)
    assert {folder[1:] for folder in folders if folder and folder[0] == 'beyond'} >= {
        (room,) for room in house.LAYERS['beyond'].rooms.split()}


def test_each_file_of_tests_has_a_name_of_its_own():
    """Pytest imports them by their names; one process cannot import two of a name."""
    names = Counter(path.name for path in TESTS.rglob('test_*.py'))
    assert [name for name, count in names.items() if count > 1] == []


def test_tests_of_the_core_import_nothing_above_it():
    """They may use public names, which the package finds in any layer."""
    wrong = []
    for path in (TESTS / 'core').rglob('test_*.py'):
        wrong += [f'{path.name} imports {module}' for _, module in house.imports_of(path)
                  if module.startswith('tf_tree_py.') and module.split('.')[1] != 'core'
                  and module.split('.')[1] in house.LAYERS]
    assert not wrong


def anys_in_a_thousand_lines(paths):
    return 1000 * sum(map(house.anys_of, paths)) / sum(house.size_of(path).code for path in paths)


def test_core_and_beyond_name_their_types():
    of_both = [path for path in house.files() if house.parts(path)[0] in ('core', 'beyond')]
    assert anys_in_a_thousand_lines(of_both) <= 4.0


def test_all_layers_name_most_of_their_types():
    assert anys_in_a_thousand_lines(house.files()) <= 8.0


def test_layers_import_only_those_below_them():
    wrong = []
    for path in house.files():
        layer = house.parts(path)[0]
        allowed = {layer, *house.LAYERS[layer].imports.split()}
        for _, module in house.imports_of(path):
            top, *below = module.split('.')
            if top == 'tf_tree_py' and below and below[0] not in allowed:
                wrong.append(f'{named(path)} imports {module}')
    assert not wrong


def test_imports_are_relative_inside_a_layer_and_absolute_across():
    wrong = []
    for path in house.files():
        layer, *below = path.relative_to(house.PACKAGE).parts
        own = f'tf_tree_py.{layer}.'
        for level, module in house.imports_of(path):
            # A relative import with at most as many dots as folders stays inside the layer.
            if level > len(below) or (level == 0 and f'{module}.'.startswith(own)):
                wrong.append(f'{named(path)} imports {"." * level}{module}')
    assert not wrong


@pytest.mark.parametrize('layer', house.LAYERS)
def test_imports_of_a_layer_form_no_circle(layer):
    for graph in (house.graph_of_files(layer), house.graph_of_rooms(layer)):
        try:
            graphlib.TopologicalSorter(graph).prepare()
        except graphlib.CycleError as error:
            pytest.fail(' imports '.join(reversed(error.args[1])))


@pytest.mark.parametrize('layer', house.LAYERS)
def test_rooms_import_only_rooms_before_them(layer):
    order = [f'{layer}/{room}' for room in house.LAYERS[layer].rooms.split()]
    wrong = [f'{room} imports {other}'
             for room, others in house.graph_of_rooms(layer).items() if room in order
             for other in others if other in order[order.index(room):]]
    assert not wrong


def test_lines_that_a_sender_can_cause_are_limited_in_one_place():
    """Rclpy's throttle hides kinds and senders behind each other, and counts nothing."""
    throttled = [named(path) for path in house.files() if 'throttle_duration_sec=' in
                 path.read_text()]
    assert not throttled


def test_nothing_is_remembered_by_its_id():
    """The next object may get the id of one that has gone, and a list may change under its id."""
    # These compare objects that exist while they are compared.
    allowed = {'bag/assembly/decoding.py', 'core/fork_locks.py'}
    asked = {named(path) for path in house.files()
             for node in ast.walk(ast.parse(path.read_text()))
             if isinstance(node, ast.Name) and node.id == 'id'}
    assert asked == allowed


def texts_in(path):
    return [node.value for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def test_no_text_begins_with_the_name_of_a_layer_above():
    """Importlib loads such names, which the rules for imports do not see."""
    wrong = []
    for path in house.files():
        layer = house.parts(path)[0]
        above = house.LAYERS.keys() - {layer, *house.LAYERS[layer].imports.split()}
        wrong += [f'{named(path)} names {text}' for text in texts_in(path)
                  if f'{text}.'.startswith(tuple(f'tf_tree_py.{other}.' for other in above))]
    assert wrong == ['labs/live/live_session.py names tf_tree_py.nodes.']  # another process


def test_core_imports_nothing_by_its_name_in_a_text():
    late = [named(path) for path in house.files() if house.parts(path)[0] == 'core'
            for _, module in house.imports_of(path) if module.split('.')[0] == 'importlib']
    assert not late


def test_only_a_pose_that_becomes_a_message_asks_the_package_for_a_public_name():
    """The package finds names of any layer, so this is a way up."""
    asking = [named(path) for path in house.files()
              for _, module in house.imports_of(path) if module == 'tf_tree_py']
    assert asking == ['beyond/framed/framed_pose.py']


# Classes with a length that are true unless it is 0, and why.
COLLECTIONS = {
    'Names': 'is a sequence of names, as a list is',
}


def test_what_has_a_length_says_whether_it_has_a_truth_value():
    """Otherwise Python counts where a caller asks for None, and an empty thing passes for None."""
    found, silent = set(), []
    for path in house.files():
        for each in ast.walk(ast.parse(path.read_text())):
            if isinstance(each, ast.ClassDef) and '__len__' in members(each) and not is_protocol(
                    each):
                found.add(each.name)
                if '__bool__' not in members(each) and each.name not in COLLECTIONS:
                    silent.append(f'{named(path)}: {each.name}: write `__bool__ = no_truth`')
    assert not silent
    assert COLLECTIONS.keys() <= found


def members(definition):
    """Return the names that a class defines itself."""
    return {name for each in definition.body for name in (
        [target.id for target in each.targets if isinstance(target, ast.Name)]
        if isinstance(each, ast.Assign) else [getattr(each, 'name', None)])}


def is_protocol(definition):
    return 'Protocol' in map(ast.unparse, definition.bases)


def test_a_room_says_what_lives_there_and_what_does_not():
    rooms = [house.PACKAGE / layer / room
             for layer, of in house.LAYERS.items() for room in of.rooms.split()]
    assert len(rooms) >= 12
    for room in rooms:
        summary, _, rest = ast.get_docstring(ast.parse(
            (room / '__init__.py').read_text())).partition('\n\n')
        assert summary.endswith('.') and rest.endswith('.'), room


@pytest.mark.parametrize('layer', WITHOUT_ROS)
def test_layer_without_ros_needs_little(layer):
    allowed = sys.stdlib_module_names | WITHOUT_ROS[layer] | {'tf_tree_py'}
    wrong = [f'{named(path)} imports {module}' for path in house.files()
             if house.parts(path)[0] == layer
             for level, module in house.imports_of(path)
             if level == 0 and module.split('.')[0] not in allowed]
    assert not wrong


# --- without ROS

BLOCKER = """
import importlib, pkgutil, sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        top = name.split('.')[0]
        if top in ('rclpy', 'launch', 'builtin_interfaces') or top.endswith('_msgs'):
            raise ModuleNotFoundError(f'no {name} here', name=name)

sys.meta_path.insert(0, Blocker())
"""


def run_without_ros(program):
    return subprocess.run(
        [sys.executable, '-c', BLOCKER + program], capture_output=True, text=True, check=False,
        timeout=PATIENCE_S, env={'PYTHONPATH': str(PACKAGE.parent), 'PATH': '/usr/bin:/bin'})


def test_layers_without_ros_import_where_there_is_none():
    # All layers but bag import what they need, besides numpy and scipy, when they first use it.
    layers = WITHOUT_ROS.keys() - ({'bag'} if find_spec('rosbags') is None else set())
    modules = ['.'.join(('tf_tree_py', *house.parts(path))) for path in house.files()
               if house.parts(path)[0] in layers]
    assert len(modules) >= 40
    result = run_without_ros(f'for name in {modules}: importlib.import_module(name)')
    assert result.returncode == 0, result.stderr


def test_package_imports_where_there_is_no_ros_and_says_what_to_install():
    result = run_without_ros("""
import tf_tree_py
from tf_tree_py import BufferCore, LookupException, Pose
BufferCore().insert('a', 'b', 1, Pose())
try:
    tf_tree_py.TransformListener
except ImportError as error:
    print(error)
try:
    tf_tree_py.FramedPose('a', 'b', Pose(), 1).as_message()
except ImportError as error:
    print(error)
""")
    assert result.returncode == 0, result.stderr
    listener, message = result.stdout.splitlines()
    assert 'TransformListener needs ROS 2' in listener
    assert 'transform_stamped needs ROS 2' in message
    assert 'is not installed: source a ROS 2 installation' in listener


def test_lookups_load_no_scipy():
    """It takes half a second and 60 MB; what needs it loads it when it is first used."""
    result = run_without_ros("""
from tf_tree_py import BufferCore, Pose
from tf_tree_py.core import Sample
buffer = BufferCore()
buffer.insert_many([Sample('a', 'b', stamp, Pose(x=stamp)) for stamp in (1, 2, 3)])
buffer.lookup('a', 'b', 2), buffer.lookup_many('a', 'b', [1, 2, 3]), buffer.snapshot()
print('scipy' in sys.modules)
""")
    assert (result.stdout, result.stderr) == ('False\n', '')
