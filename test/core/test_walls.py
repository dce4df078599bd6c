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

"""Imports go down only: between the layers, and inside the core."""

import ast
from functools import cache
import itertools
from pathlib import Path
import subprocess
import sys

from programs import PATIENCE_S
import pytest
import tf_tree_py

PACKAGE = Path(tf_tree_py.__file__).parent

# A layer may import those that it names, and itself.
LAYERS = {
    'interfaces': set(),
    'core': set(),
    'urdf': {'core'},
    'bag': {'core', 'urdf'},
    'fleet': {'core'},
    'ros': {'core'},
    'nodes': {'core', 'bag', 'urdf', 'fleet', 'ros'},
    'tools': {'core', 'bag', 'urdf', 'fleet', 'ros'},
    'view': {'core', 'bag', 'urdf', 'fleet', 'ros', 'tools'},
    'labs': {'core', 'bag', 'urdf', 'ros'},
    'dropin': {'core', 'bag', 'ros'},
}


def rooms(*lines):
    """Return the dotted names of files: each line a room, and what stands in it."""
    return [f'{room}.{name}'.lstrip('.') for line in lines
            for room, _, names in [line.partition(':')] for name in names.split()]


# Inside these layers a file imports only files above it; so rooms have an order too.
ORDER = {
    'interfaces': rooms(': hashes cmake_exports building __main__'),
    'core': rooms(
        ': calling stamp text suggest errors times',
        'geometry: so3 se3 screws covariances pose poses se2 spline spline_fit blend',
        'edges: track storage columns protocol packed static discrete aided correction corrected '
        'uncertainty spline_samples spline spline_track spline_history spline_fitter kinds',
        'arrivals: incidents incident_log sample estimate received observers track frame_names '
        'block cursor estimate_bytes diagnostic_bytes layout wire stencil future_guard jump_back '
        'streams meters merging',
        'tree: many climb path ways spanning remarks tree propagation uncertain prediction '
        'frozen outline many_stamps samples lookups corrections sources queries',
        'buffer: waiters deadline waiting refusals intake correcting switching buffer_core',
        'departures: pacing dead_band thinning sending',
        ': deskew twist trajectory anchor',
        'telling: table audit audit_file report diagnosis made_way poses missing certainty '
        'explanation words frame_graph drawings',
        'vitals: limits spread stretch timing motion gathering edge signs',
        'checks: finding case check names structure values stamps statics rates motions '
        'publishers sources catalogue',
        ': doctor monitor flight_recorder',
    ),
    'bag': rooms(
        ': errors progress',
        'files: source finding joint_states rosbags_file salvage mcap_scan ros1_scan sqlite_scan '
        'kinds reading',
        'assembling: decoding window oddities order assembly covariances',
        ': joints opening stamps recorder',
    ),
    'fleet': rooms(
        ': errors keys attachment session publishing trust roster presence feed listening '
        'hearing link listener uplink simulated',
    ),
    'ros': rooms(
        'messages: fast_messages convert times covariance geometry uncertain point_cloud '
        'laser_scan arrays point_times deskew_cloud do_transform registry',
        'threads: complaint companion receiver response_receiver',
        'waiting: clock alarm_clock timeouts awaitable futures',
        'buffer: wrong_arguments feeds interface twists tf2_methods buffer',
        'topics: qos authority endpoints rivals broadcaster listener side_topics covariances gyro',
        'remote: lookup_goal goal_state lookup_call server_watch goal_client buffer_client '
        'buffer_server',
        'filtering: drop_reasons message_filter',
        ': diagnostics',
    ),
    'view': rooms(
        'shown: living moment playhead trail colours ellipsoid listing facts shapes',
        ': subject',
        'page: asking markup labels links stale_axes doubt scene timeline frames_panel '
        'chosen_panel findings_panel look_panel page',
        ': serving tf_view',
    ),
    'urdf': rooms(
        ': elements values visuals joints hanging following motion expanding robot states '
        'tracks',
    ),
    'tools': rooms(
        ': endings arguments output live recording fleet source drawing dump_requests '
        'doctor_report tf_audit tf_doctor tf_echo tf_frames tf_monitor tf_record',
        'export: stamp_file plan formats',
        ': tf_export',
        'archive: bags page jobs ledger table shielding cluster running',
        ': tf_archive ros2_verbs',
    ),
}

# Layers that know no ROS, and what they may need beside Python itself.
WITHOUT_ROS = {
    'interfaces': {'numpy'},
    'core': {'numpy', 'scipy'},
    'fleet': {'numpy', 'tf_tree_py', 'zenoh'},
    'urdf': {'numpy', 'tf_tree_py', 'xacro'},
}

# What lies in dropin/packages is imported under other names, and imports as users do.
FILES = sorted(path for path in PACKAGE.rglob('*.py')
               if not {'__pycache__', 'packages'} & set(path.parts))


def named(path):
    return '/'.join(path.relative_to(PACKAGE).parts)


@cache
def imports_of(path):
    """Return every import in a file as (level, module): level 0 is absolute."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(0, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.level, '.'.join(filter(None, (node.module, alias.name))))
                      for alias in node.names]
    return found


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


def modules_of(layer):
    """Return each module of a layer by its name below it, and where it is."""
    root = PACKAGE / layer
    return {'.'.join(path.relative_to(root).with_suffix('').parts): path
            for path in root.rglob('*.py') if path.stem != '__init__'}


@pytest.mark.parametrize('layer', ORDER)
def test_every_file_has_its_place(layer):
    assert sorted(modules_of(layer)) == sorted(ORDER[layer]), 'say in ORDER what it may import'


@pytest.mark.parametrize('layer', ORDER)
def test_rooms_stand_one_above_the_other(layer):
    rooms = [name.rpartition('.')[0] or name for name in ORDER[layer]]
    assert len(list(itertools.groupby(rooms))) == len(set(rooms)), 'a room is torn apart'


@pytest.mark.parametrize('layer', ORDER)
def test_files_import_only_files_above_them(layer):
    wrong = []
    paths = modules_of(layer)
    for place, name in enumerate(ORDER[layer]):
        path = paths[name]
        package = path.relative_to(PACKAGE / layer).parent.parts
        for level, module in imports_of(path):
            if level == 0:
                continue
            reached = '.'.join((*package[:len(package) - level + 1], *module.split('.')))
            if not any(f'{reached}.'.startswith(f'{above}.') for above in ORDER[layer][:place]):
                wrong.append(f'{named(path)} imports {reached}')
    assert not wrong


def test_a_room_says_what_lives_there_and_what_does_not():
    rooms = [path for layer in ORDER for path in (PACKAGE / layer).iterdir()
             if (path / '__init__.py').exists()]
    assert len(rooms) >= 12
    for room in rooms:
        summary, _, rest = ast.get_docstring(ast.parse(
            (room / '__init__.py').read_text())).partition('\n\n')
        assert summary.endswith('.') and rest.endswith('.'), room


@pytest.mark.parametrize('layer', WITHOUT_ROS)
def test_layer_without_ros_needs_little(layer):
    allowed = sys.stdlib_module_names | WITHOUT_ROS[layer]
    wrong = [f'{named(path)} imports {module}' for path in (PACKAGE / layer).rglob('*.py')
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
        [sys.executable, '-c', BLOCKER + program], capture_output=True, text=True, check=False,
        timeout=PATIENCE_S, env={'PYTHONPATH': str(PACKAGE.parent), 'PATH': '/usr/bin:/bin'})


def test_layers_without_ros_import_where_there_is_none():
    modules = [f'tf_tree_py.{layer}.{name}' for layer in WITHOUT_ROS for name in modules_of(layer)]
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
""")
    assert result.returncode == 0, result.stderr
    assert 'TransformListener needs ROS 2' in result.stdout
    assert 'is not installed: source a ROS 2 installation' in result.stdout
