# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
ROS parameters, each described once: for the node, for ``--help`` and for error texts.

By default parameters cannot change while the node runs; an attempt to set one fails.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node
from tf_tree_py.core.text import nearest

from .bad_input import BadInput

Values = dict[str, Any]
"""The values of parameters by name, each of its own type."""


@dataclass(frozen=True)
class Setting:
    """
    One parameter of a node: a string, a bool, a list of strings, or, with limits, a number.

    With limits and a table as its default it is a number for each of any names, given as
    ``-p rates.odom:=20`` or, in a file, as ``rates: {odom: 20}``.

    :ivar limits: the minimum and the maximum of a number.
    :ivar changeable: whether it can be set while the node runs; the node applies the change.
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
            raise BadInput(f'parameter {self.name} must be true or false, not {given!r}')
        if not isinstance(self.default, str | float):
            return self._check_names(given)
        if self.limits is None:
            if isinstance(given, str):
                return given
            raise BadInput(f'parameter {self.name} must be a string, not {given!r}')
        lowest, highest = self.limits
        # ROS distinguishes 2 and 2.0, but users do not. In Python a bool is an int, but not here.
        if type(given) in (int, float) and lowest <= given <= highest:
            return float(given)
        raise BadInput(f'parameter {self.name} must be a number from {lowest} to {highest}, '
                       f'not {given!r}')

    def _check_names(self, given: object) -> list[str]:
        # ROS turns [] into None, and users omit the brackets around a single name.
        names = [] if given is None else [given] if isinstance(given, str) else given
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            raise BadInput(f'parameter {self.name} must be a list of strings, not {given!r}')
        # ROS requires a type for an empty list, so users write [''] instead.
        return [name for name in names if name]

    def descriptor(self) -> ParameterDescriptor:
        """Return the description that ``ros2 param describe`` shows."""
        ranges = []
        if self.limits is not None:
            lowest, highest = self.limits
            ranges.append(FloatingPointRange(from_value=lowest, to_value=highest))
        return ParameterDescriptor(description=self.meaning, read_only=not self.changeable,
                                   floating_point_range=ranges)


# rclpy declares these when a publisher or a subscription is made.
_QOS_OVERRIDES = 'qos_overrides.'

FRAME_PREFIX = Setting('frame_prefix', '', 'a prefix for every frame name, such as robot1/')


def declare(node: Node, settings: Iterable[Setting], others: Iterable[Setting] = ()) -> Values:
    """
    Declare parameters, and return their values by name; warn about unknown ones.

    :param others: parameters of other nodes in this process, because the command line passes
        all parameters to every node.
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
            f'there is no parameter {name!r}, so its value is ignored'
            + (f'; did you mean {meant!r}?' if meant else '.')
            + (f' Parameters: {", ".join(known)}' if known else ' This node has no parameters'))


def given(node: Node, setting: Setting) -> Any:
    """
    Return the value of a parameter before its declaration, because others may depend on it.

    :raises BadInput: it has a wrong type or is out of its range.
    """
    # Any type is accepted, so that a wrong one gets our error; its own type is declared later.
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


def _declare_table(node: Node, table: Setting) -> dict[str, float]:
    given, begin = _given(node), f'{table.name}.'
    if table.name in given:
        raise BadInput(f'parameter {table.name} must be a number for each name, such as '
                       f'-p {begin}NAME:=1.0 or, in a file, {table.name}: {{NAME: 1.0}}')
    return {name.removeprefix(begin): _declare(node, replace(table, name=name, default=0.0))
            for name in given if name.startswith(begin)}


def describe(settings: Iterable[Setting]) -> str:
    """Return the part of a ``--help`` text that lists parameters."""
    lines = ['ROS parameters (--ros-args -p NAME:=VALUE, or --ros-args --params-file FILE):']
    for setting in settings:
        limits = '' if setting.limits is None else ', {} to {}'.format(*setting.limits)
        name = f'{setting.name}.NAME' if isinstance(setting.default, Mapping) else setting.name
        lines += [f'  {name} (default {setting.default!r})', f'      {setting.meaning}{limits}']
    return '\n'.join(lines)
