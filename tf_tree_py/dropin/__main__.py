# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs a program, a module or a test run with tf2's names backed by this package."""

import argparse
from importlib.util import find_spec
from pathlib import Path
import runpy
import sys

from . import install, PACKAGES

_DESCRIPTION = """\
Run a Python program. Where tf2_ros, tf2_py, tf2_geometry_msgs, tf2_sensor_msgs or
tf_transformations is not installed, tf_tree_py replaces it. The program is not changed."""

_EPILOG = """\
examples:
  python -m tf_tree_py.dropin your_node.py --ros-args -p use_sim_time:=true
  python -m tf_tree_py.dropin -m pytest test
  PYTHONPATH=$PYTHONPATH:$(python -m tf_tree_py.dropin --path) ros2 launch ..."""


def main(argv: list[str]) -> None:
    """Run the program of the command line, as Python itself would run it."""
    parser = argparse.ArgumentParser(
        'python -m tf_tree_py.dropin', description=_DESCRIPTION, epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
        usage='%(prog)s [--force] (PROGRAM.py | -m MODULE) [ARGUMENTS...]\n       %(prog)s --path')
    parser.add_argument('--force', action='store_true',
                        help="use tf_tree_py even if tf2's own packages are installed; an "
                        'installed tf_transformations still takes precedence')
    parser.add_argument('--path', action='version', version=PACKAGES,
                        help='print the folder with the packages, for PYTHONPATH')
    parser.add_argument('-m', dest='is_module', action='store_true',
                        help='run a module instead of a file')
    parser.add_argument('program', help='the program or module to run')
    arguments = parser.add_argument('arguments', nargs=argparse.REMAINDER, help='its arguments')
    arguments.required = False  # so that the error names the missing argument
    options = parser.parse_args(argv)
    sys.argv = [options.program, *options.arguments]
    if options.is_module:
        _install(options.force)
        runpy.run_module(options.program, run_name='__main__', alter_sys=True)
        return
    program = Path(options.program)
    if not program.exists():
        parser.error(f'there is no {options.program!r} to run')
    # The folder of the program, as Python sets it; until now it was the current one. With python
    # -P there is neither.
    if not getattr(sys.flags, 'safe_path', False):
        sys.path[0] = str(program.resolve().parent)
    _install(options.force)
    runpy.run_path(options.program, run_name='__main__')


def _install(force: bool) -> None:
    install(force)
    found = find_spec('tf2_ros')
    if found is not None and not str(found.origin).startswith(PACKAGES):
        print(f'tf_tree_py.dropin: the program runs on the tf2_ros that is installed as '
              f'{found.origin}; --force runs it on tf_tree_py', file=sys.stderr)


if __name__ == '__main__':
    main(sys.argv[1:])
