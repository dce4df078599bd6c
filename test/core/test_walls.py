"""Imports go down only: between the layers, and inside the core."""

import ast
from pathlib import Path
import pkgutil
import subprocess
import sys

import tf_tree_py
from tf_tree_py import core

PACKAGE = Path(tf_tree_py.__file__).parent

# A layer may import those that it names, and itself.
LAYERS = {
    'core': set(),
    'bag': {'core'},
    'ros': {'core'},
    'nodes': {'core', 'bag', 'ros'},
    'tools': {'core', 'bag', 'ros'},
    'labs': {'core', 'bag', 'ros'},
    'dropin': {'core', 'bag', 'ros'},
}

# Inside the core a file imports only files above it.
CORE = [
    'calling', 'stamp', 'text', 'suggest', 'errors', 'times', 'so3', 'se3', 'pose', 'poses', 'se2',
    'many', 'history', 'climb', 'path', 'incidents', 'sample', 'track', 'tree', 'waiters',
    'deadline', 'frame_names', 'wire', 'outline', 'queries', 'future_guard', 'jump_back',
    'streams', 'arrivals', 'buffer_core', 'deskew', 'twist', 'audit', 'report',
]
WITHOUT_ROS = {'numpy', 'scipy'}

# What lies in dropin/packages is imported under other names, and imports as users do.
FILES = sorted(path for path in PACKAGE.rglob('*.py')
               if not {'__pycache__', 'packages'} & set(path.parts))


def named(path):
    return '/'.join(path.relative_to(PACKAGE).parts)


def imports_of(path):
    """Yield every import in a file as (level, module): level 0 is absolute."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield 0, alias.name
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield node.level, '.'.join(filter(None, (node.module, alias.name)))


def test_layers_import_only_those_below_them():
    wrong = []
    for path in FILES:
        layer = path.relative_to(PACKAGE).parts[0]
        allowed = LAYERS.get(layer, set(LAYERS)) | {layer}
        for level, module in imports_of(path):
            top, *below = module.split('.')
            if level == 0 and top == 'tf_tree_py' and below and below[0] not in allowed:
                wrong.append(f'{named(path)} imports {module}')
    assert not wrong


def test_imports_are_relative_inside_a_layer_and_absolute_across():
    wrong = []
    for path in FILES:
        layer, *below = path.relative_to(PACKAGE).parts
        own = f'tf_tree_py.{layer}.'
        for level, module in imports_of(path):
            # As many dots as folders stay inside the layer.
            if level > len(below) or (level == 0 and f'{module}.'.startswith(own)):
                wrong.append(f'{named(path)} imports {"." * level}{module}')
    assert not wrong


def test_every_layer_is_known():
    folders = {path.name for path in PACKAGE.iterdir() if any(path.glob('*.py'))}
    assert folders <= set(LAYERS)


def test_every_file_of_the_core_has_its_place():
    found = {path.stem for path in PACKAGE.glob('core/*.py')} - {'__init__'}
    assert found - set(CORE) == set(), 'say in CORE what they may import'


def test_files_of_the_core_import_only_files_above_them():
    wrong = []
    for place, name in enumerate(CORE):
        path = PACKAGE / 'core' / f'{name}.py'
        if path.exists():
            wrong += [f'{named(path)} imports {module}' for level, module in imports_of(path)
                      if level == 1 and module.split('.')[0] not in CORE[:place]]
    assert not wrong


def test_core_needs_nothing_but_numpy_and_scipy():
    allowed = sys.stdlib_module_names | WITHOUT_ROS
    wrong = [f'{named(path)} imports {module}' for path in PACKAGE.glob('core/*.py')
             for level, module in imports_of(path)
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
        [sys.executable, '-c', BLOCKER + program], capture_output=True, text=True, timeout=60,
        env={'PYTHONPATH': str(PACKAGE.parent), 'PATH': '/usr/bin:/bin'}, check=False)


def test_core_imports_where_there_is_no_ros():
    modules = [f'tf_tree_py.core.{module.name}' for module in pkgutil.iter_modules(core.__path__)]
    assert len(modules) >= 15
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
""")
    assert result.returncode == 0, result.stderr
    assert 'TransformListener needs ROS 2' in result.stdout
    assert 'is not installed: source a ROS 2 installation' in result.stdout
