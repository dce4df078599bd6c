# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``from tf2_ros import *`` imports the same names as tf2's, also those of Python and numpy."""

import json

from programs import completed
import pytest
from standin import standin_env

PROGRAM = """
import json
MODULES = ('tf2_ros', 'tf2_ros.buffer', 'tf2_ros.buffer_client', 'tf2_ros.buffer_interface',
           'tf2_ros.static_transform_broadcaster', 'tf2_ros.transform_broadcaster',
           'tf2_ros.transform_listener', 'tf2_geometry_msgs',
           'tf2_geometry_msgs.tf2_geometry_msgs', 'tf2_sensor_msgs',
           'tf2_sensor_msgs.tf2_sensor_msgs')
found = {}
for module in MODULES:
    names = {}
    exec(f'from {module} import *', names)
    found[module] = {name: getattr(thing, '__module__', None) or getattr(thing, '__name__', '')
                     for name, thing in names.items() if name[0] != '_'}
print(json.dumps(found))
"""
# A helper for Windows.
NOT_OURS = {'add_dll_directories_from_env'}


IMPORTS = """
import json, sys
import tf2_ros
print(json.dumps([name for name in sys.modules if '._' not in name and (
    name.startswith('rclpy') or '_msgs' in name)]))
"""


def output_of(code, tmp_path, *command):
    program = tmp_path / 'program.py'
    program.write_text(code)
    done = completed('python3', *command, str(program), env=standin_env())
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_star_imports_hand_over_what_those_of_tf2_do(tmp_path):
    theirs = output_of(PROGRAM, tmp_path)
    ours = output_of(PROGRAM, tmp_path, '-m', 'tf_tree_py.dropin', '--force')
    for module, names in theirs.items():
        assert not {*names} - {*ours[module]} - NOT_OURS, module
        for name, home in names.items():
            # An alias such as MsgStamped is a Union there, and is written with | here.
            if name in ours[module] and not home.startswith(('tf2', '_tf2', 'typing')):
                assert ours[module][name] == home, name
    # Additional names would replace the program's own.
    assert {name for name in ours['tf2_ros'] if name not in theirs['tf2_ros']} == {
        'StaticTransformListener'}


@pytest.mark.parametrize('use', [
    'from tf2_ros import *\nanswer: Optional[Tuple[int]] = None\nsleep(0)\nthreading.Thread()',
    'from tf2_ros import *\nassert deepcopy([1]) == [1] and rclpy.ok() is False',
    'from tf2_ros import *\nassert buffer.Buffer is Buffer and transform_listener',
    'from tf2_geometry_msgs import *\nassert np.zeros(3).sum() == 0 and Pose().position.x == 0.0',
    'from tf2_geometry_msgs import *\nassert tf2_geometry_msgs.do_transform_pose',
    'from tf2_ros.transform_listener import *\nassert Node and Union and Thread',
    'Pose = 7\nfrom tf2_ros import *\nassert Pose == 7',
])
def test_program_that_relies_on_a_star_import_runs(tmp_path, use):
    program = tmp_path / 'program.py'
    program.write_text(use)
    done = completed('python3', '-m', 'tf_tree_py.dropin', '--force', str(program))
    assert done.returncode == 0, done.stderr


def test_import_of_tf2_ros_loads_the_modules_that_tf2s_does(tmp_path):
    """Programs write rclpy.executors or geometry_msgs.msg without an import of their own."""
    theirs = output_of(IMPORTS, tmp_path)
    ours = output_of(IMPORTS, tmp_path, '-m', 'tf_tree_py.dropin', '--force')
    assert 'rclpy.executors' in theirs
    assert [name for name in theirs if name not in ours and not name.startswith('tf2_')] == []
