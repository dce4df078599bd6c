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

"""
ROS parameters, each described once: for the node, for ``--help`` and for error texts.

Unless it says otherwise, none can change while the node runs; trying to set one gets an error.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node
from tf_tree_py.core.suggest import nearest

from .bad_input import BadInput


@dataclass(frozen=True)
class Setting:
    """
    One parameter of a node: a string, a bool, a list of strings, or, with limits, a number.

    With limits and a table as its default it is a number for each of any names, given as
    ``-p rates.odom:=20`` or, in a file, as ``rates: {odom: 20}``.

    :ivar limits: the least and the greatest value of a number.
    :ivar changeable: whether it can be set while the node runs; the node looks after that.
    """

    name: str
    default: str | bool | float | Sequence[str] | Mapping[str, float]
    meaning: str
    limits: tuple[float, float] | None = None
    changeable: bool = False

    def check(self, given: Any) -> str | bool | float | list[str]:
        """
        Return a given value in the parameter's type.

        :raises BadInput: it is of another type, or out of range.
        """
        if isinstance(self.default, bool):
            if isinstance(given, bool):
                return given
            raise BadInput(f'parameter {self.name} has to be true or false, not {given!r}')
        if not isinstance(self.default, str | float):
            return self._check_names(given)
        if self.limits is None:
            if isinstance(given, str):
                return given
            raise BadInput(f'parameter {self.name} has to be a string, not {given!r}')
        lowest, highest = self.limits
        # ROS distinguishes 2 and 2.0; people do not. A bool is an int in Python, but not here.
        if type(given) in (int, float) and lowest <= given <= highest:
            return float(given)
        raise BadInput(f'parameter {self.name} has to be a number from {lowest} to {highest}, '
                       f'not {given!r}')

    def _check_names(self, given: Any) -> list[str]:
        # ROS turns [] into None, and people leave out the brackets around one name.
        names = [] if given is None else [given] if isinstance(given, str) else given
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            raise BadInput(f'parameter {self.name} has to be a list of strings, not {given!r}')
        # ROS needs to know the type of an empty list, so people write [''] for it.
        return [name for name in names if name]

    def descriptor(self) -> ParameterDescriptor:
        """Return what ``ros2 param describe`` shows."""
        ranges = []
        if self.limits is not None:
            lowest, highest = self.limits
            ranges.append(FloatingPointRange(from_value=lowest, to_value=highest))
        return ParameterDescriptor(
            description=self.meaning, read_only=not self.changeable,
            floating_point_range=ranges)


# rclpy declares these when a publisher or a subscription is made.
_QOS_OVERRIDES = 'qos_overrides.'

FRAME_PREFIX = Setting('frame_prefix', '', 'goes before every frame name, such as robot1/')


def declare(node: Node, settings: Iterable[Setting],
            others: Iterable[Setting] = ()) -> dict[str, Any]:
    """
    Declare parameters, and return their values by name; warn of unknown ones.

    :param others: parameters of other nodes in this process: the command line gives all of
        them to every node.
    :raises BadInput: one has a wrong type or is out of its range.
    """
    values = {setting.name: _declare(node, setting) for setting in settings}
    _warn_of_unknown(node, list(values), {setting.name for setting in others})
    return values


def _given(node: Node) -> Collection[str]:
    # rclpy has no public way to get the parameters that were given but not declared.
    return getattr(node, '_parameter_overrides', ())


def _warn_of_unknown(node: Node, known: list[str], others: Collection[str]) -> None:
    for name in _given(node):
        if node.has_parameter(name) or name in others or name.startswith(_QOS_OVERRIDES):
            continue
        meant = nearest(name, known)
        node.get_logger().warning(
            f'there is no parameter {name!r}, its value is ignored'
            + (f'; did you mean {meant!r}?' if meant else '.')
            + (f' There are: {", ".join(known)}' if known else ' This node has none'))


def given(node: Node, setting: Setting) -> Any:
    """
    Return the value that a parameter will have, on which others may depend.

    :raises BadInput: it has a wrong type or is out of its range.
    """
    # Of any type, so that a wrong one gets our sentence; then it can be declared with its own.
    anything = ParameterDescriptor(dynamic_typing=True)
    value = node.declare_parameter(setting.name, setting.default, anything).value
    node.undeclare_parameter(setting.name)
    return setting.check(value)


def _declare(node: Node, setting: Setting) -> Any:
    if isinstance(setting.default, Mapping):
        return _declare_table(node, setting)
    value = given(node, setting)
    node.declare_parameter(setting.name, value, setting.descriptor(), ignore_override=True)
    return value


def _declare_table(node: Node, table: Setting) -> dict[str, Any]:
    given, begin = _given(node), f'{table.name}.'
    if table.name in given:
        raise BadInput(f'parameter {table.name} has to be a number for each name, such as '
                       f'-p {begin}NAME:=1.0 or, in a file, {table.name}: {{NAME: 1.0}}')
    return {name.removeprefix(begin): _declare(node, replace(table, name=name, default=0.0))
            for name in given if name.startswith(begin)}


def describe(settings: Iterable[Setting]) -> str:
    """Return the part of a ``--help`` text that lists parameters."""
    lines = ['ROS parameters (--ros-args -p NAME:=VALUE, or --ros-args --params-file FILE):']
    for setting in settings:
        limits = '' if setting.limits is None else ', {} to {}'.format(*setting.limits)
        name = f'{setting.name}.NAME' if isinstance(setting.default, Mapping) else setting.name
        lines += [f'  {name} (default {setting.default!r})',
                  f'      {setting.meaning}{limits}']
    return '\n'.join(lines)
