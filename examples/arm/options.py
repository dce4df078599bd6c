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

"""What both commands can be told: how many runs, which, and in which form they are reported."""

import argparse

NAME = 'arm'

_DESCRIPTION = """\
A simulated arm with a camera on its wrist picks a red block and places it in a tray. What the
camera sees, the transform tree takes to the world: docs/pick_and_place.md goes through it."""


def parser() -> argparse.ArgumentParser:
    """Return a parser; a command adds what only it can be told."""
    options = argparse.ArgumentParser(prog=NAME, description=_DESCRIPTION, allow_abbrev=False)
    options.add_argument('--runs', type=_positive, default=20, metavar='N',
                         help='how many blocks, one after the other; 20 unless given')
    options.add_argument('--seed', type=_natural, default=0, metavar='N',
                         help='which random blocks; 0 unless given')
    options.add_argument('--json', action='store_true', help='print JSON instead')
    options.add_argument('--ros', action='store_true',
                         help='over DDS: the arm, perception and the tree in processes of their '
                              'own, in real time')
    return options


def _natural(text: str) -> int:
    if (number := int(text)) < 0:
        raise ValueError
    return number


def _positive(text: str) -> int:
    if (number := int(text)) < 1:
        raise ValueError
    return number
