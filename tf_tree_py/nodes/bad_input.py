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

"""Checks of names and numbers that a person typed; no ROS."""

from argparse import ArgumentTypeError
import math


class BadInput(Exception):
    """One sentence for the user; an executable prints it without a traceback and ends."""


def frame_name(what: str, name: object) -> str:
    """
    Return a name that can be looked up.

    :param what: what the name is for, for the error.
    :raises BadInput: it is no string, is empty, or has a leading slash.
    """
    if not isinstance(name, str) or not name or name.startswith('/'):
        raise BadInput(f'{what} has to be a frame name, not empty and without a leading slash; '
                       f'{name!r} is none')
    return name


def number(text: str) -> float:
    """Return a finite number of the command line."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentTypeError(f'{text!r} is not a finite number')
    return value


def positive_number(text: str) -> float:
    """Return a number of the command line that is greater than zero."""
    value = number(text)
    if value <= 0.0:
        raise ArgumentTypeError(f'{text} is not greater than zero')
    return value
