# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Imports have one direction, between the layers and inside them."""

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

# The layers that a layer may import, besides itself.
LAYERS = {
    'interfaces': set(),
    'command': set(),
    'core': set(),
    'urdf': {'core'},
    'bag': {'core', 'urdf'},
    'calibration': {'core', 'bag'},
    'fleet': {'core'},
    'ros': {'core'},
    'nodes': {'command', 'core', 'bag', 'urdf', 'fleet', 'ros'},
    'tools': {'command', 'core', 'calibration', 'bag', 'urdf', 'fleet', 'ros'},
    'view': {'command', 'core', 'bag', 'urdf', 'fleet', 'ros', 'tools'},
    'labs': {'command', 'core', 'calibration', 'bag', 'urdf', 'ros'},
    'dropin': {'core', 'bag', 'ros'},
}


def rooms(*lines):
    """Return the dotted names of files; each line is a package and its modules."""
    return [f'{room}.{name}'.lstrip('.') for line in lines
            for room, _, names in [line.partition(':')] for name in names.split()]


# Inside these layers, a file imports only files that are listed before it.
ORDER = {
    'interfaces': rooms(': hashes cmake_exports building __main__'),
    'command': rooms(': signals endings starting arguments output'),
    'core': rooms(
        ': fork_locks callbacks deprecation stamp liveness text whole_files suggestions errors '
        'times',
        'geometry: so3 se3 screws covariance_rows covariances large_angles gating poses '
        'many_poses pose framed_pose spline_segment spline_fit spline_running_fit blend',
        'edges: track storage columns protocol packed static discrete gyro aided stage correction '
        'corrected uncertainty spline_samples spline_pieces spline_track spline spline_fitter '
        'curve constant_twist curve_history kinds',
        'ingest: incidents incident_log sample edge_estimate received_message observers '
        'sample_track frame_names message_block byte_cursor estimate_bytes diagnostic_bytes '
        'message_layout wire message_template future_guard jump_back duplicate_streams',
        'tree: many climb path path_finder spanning tree_incidents source_samples '
        'forecast trials tree '
        'propagation uncertain_lookup uncertain shared_errors prediction frozen outline '
        'many_stamps edge_samples lookups '
        'corrections sources queries',
        'buffer: waiters deadline waiting refusal_warnings intake correction_arguments switching '
        'buffer_core',
        'thinning: rate_limit dead_band thinner senders',
        ': deskew twist trajectory anchor',
        'reports: text_table audit audit_file frames_text switch_status pose_text '
        'missing_transform certainty explanation explanation_text frame_graph drawings',
        'health.measures: thresholds spread sample_rows lately clock_steps timing timebase motion '
        'message_columns edge_record symptoms pieces',
        'health.checks: finding case check frame_name_checks structure values clocks stamp_order '
        'statics rates motions publishers edge_sources catalogue',
        'health: doctor monitor recent_messages flight_recorder',
    ),
    'bag': rooms(
        ': errors progress',
        'files: message_source message_types discovery joint_states size_limit unpacking '
        'rosbags_file salvage mcap_scan ros1_scan sqlite_scan file_kinds bag_reader',
        'assembly: decoding message_window anomalies stamp_order assembler covariances',
        ': joints no_transforms opening stamps recorder',
    ),
    'calibration': rooms(
        ': errors observations chain unknowns model spread jitter solve start observability '
        'verdict result calibrating detections recorded',
    ),
    'fleet': rooms(
        ': errors keys attachment certificates session robot_publisher trust quota roster '
        'presence inbox worker_threads transform_decoder reception old_caches subscriptions '
        'connection listener uplink simulated',
    ),
    'ros': rooms(
        'messages: fast_messages convert times covariance geometry pose_covariances point_cloud '
        'laser_scan arrays point_times deskew_cloud do_transform registry',
        'threads: context_state rate_limited_log internal_node receiver response_receiver',
        'waiting: clock alarm_clock timeouts awaitable futures',
        'buffer: wrong_arguments attached_listeners interface twists tf2_methods buffer',
        'topics: qos publisher_names endpoints duplicate_publishers broadcaster listener '
        'shared_buffer side_topics covariances gyro',
        'remote: lookup_goal goal_state lookup_call server_watch goal_client buffer_client '
        'buffer_server',
        'filtering: drop_reasons message_filter',
        ': diagnostics',
    ),
    'view': rooms(
        'model: liveness moment opening playhead trail colours ellipsoid listing facts '
        'incident_log finding_time relative_motion view_link film_stamps',
        'robot: mesh_files shapes extent resting_robot',
        'sensors: images readings placing sensor_source recorded_sensors live_sensors',
        'framing: camera sizes label_layout',
        ': subject access',
        'scene: ground labels links stale_axes uncertainty_ellipsoid sensor_points scene',
        'panels: control_events markup view_buttons timeline frames_panel chosen_panel '
        'motion_panel sensors_panel findings_panel joints_panel appearance_panel pictures_panel',
        'page: browser camera_control framing controls address sensor_view film page',
        ': wake_ups serving tf_view starting',
    ),
    'urdf': rooms(
        ': xml_elements xml_values visuals joints tree_check mimic motion xacro_files robot '
        'joint_states recorded_states',
    ),
    'tools': rooms(
        ': tree_arguments live_tree recorded_tree fleet_tree tree_source drawing dump_requests '
        'doctor_report tf_audit tf_doctor tf_echo tf_frames tf_monitor tf_record',
        'export: stamp_file plan viewer_files formats',
        ': tf_export',
        'archive: bags page jobs ledger table ignore_ctrl_c cluster running',
        ': tf_archive',
        'calibrate: report picture urdf_origin live',
        ': tf_calibrate ros2_verbs starting',
    ),
}

# Layers without ROS, and the packages that they may need besides the standard library.
WITHOUT_ROS = {
    'interfaces': {'numpy'},
    'command': set(),
    'core': {'numpy', 'scipy'},
    'calibration': {'numpy', 'rosbags', 'scipy', 'tf_tree_py'},
    'fleet': {'numpy', 'tf_tree_py', 'zenoh'},
    'urdf': {'numpy', 'tf_tree_py', 'xacro'},
}

# dropin/packages has other import names, and imports like a user's code.
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
            # A relative import with at most as many dots as folders stays inside the layer.
            if level > len(below) or (level == 0 and f'{module}.'.startswith(own)):
                wrong.append(f'{named(path)} imports {"." * level}{module}')
    assert not wrong


def test_every_layer_is_known():
    folders = {path.name for path in PACKAGE.iterdir() if any(path.glob('*.py'))}
    assert folders <= set(LAYERS)


def modules_of(layer):
    """Return the path of each module of a layer, by its dotted name below the layer."""
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
