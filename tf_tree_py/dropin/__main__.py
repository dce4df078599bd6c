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

"""Runs a program, a module or a test run with tf2's names backed by this package."""

import argparse
from pathlib import Path
import runpy
import sys

from . import install, PACKAGES

_DESCRIPTION = """\
Run a Python program whose imports of tf2_ros, tf2_py, tf2_geometry_msgs and tf2_sensor_msgs
are served by tf_tree_py where they are not installed. The program is not changed."""

_EPILOG = """\
examples:
  python -m tf_tree_py.dropin your_node.py --ros-args -p use_sim_time:=true
  python -m tf_tree_py.dropin -m pytest test
  PYTHONPATH=$PYTHONPATH:$(python -m tf_tree_py.dropin --path) ros2 launch ..."""


def main(argv: list[str]) -> None:
    """Run what the command line says, as Python itself would run it."""
    parser = argparse.ArgumentParser(
        'python -m tf_tree_py.dropin', description=_DESCRIPTION, epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
        usage='%(prog)s [--force] (PROGRAM.py | -m MODULE) [ARGUMENTS...]\n       %(prog)s --path')
    parser.add_argument('--force', action='store_true',
                        help="let tf_tree_py serve them even where tf2's own are installed")
    parser.add_argument('--path', action='version', version=PACKAGES,
                        help='print the folder with the packages, for PYTHONPATH')
    parser.add_argument('-m', dest='is_module', action='store_true',
                        help='run a module instead of a file')
    parser.add_argument('program', help='what to run')
    arguments = parser.add_argument('arguments', nargs=argparse.REMAINDER, help='its arguments')
    arguments.required = False  # for the sentence that says what is missing
    options = parser.parse_args(argv)
    sys.argv = [options.program, *options.arguments]
    if options.is_module:
        install(options.force)
        runpy.run_module(options.program, run_name='__main__', alter_sys=True)
        return
    program = Path(options.program)
    if not program.exists():
        parser.error(f'there is no {options.program!r} to run')
    # The folder of the program, as Python has it; until now it was the current one. With
    # python -P there is neither.
    if not getattr(sys.flags, 'safe_path', False):
        sys.path[0] = str(program.resolve().parent)
    install(options.force)
    runpy.run_path(options.program, run_name='__main__')


if __name__ == '__main__':
    main(sys.argv[1:])
