# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros, backed by tf_tree_py; each of its own is loaded on first use."""

from importlib import import_module
from typing import Any

from tf_tree_py.dropin import imported_names
from tf_tree_py.dropin.imported_names import load_what_tf2_loads, star

load_what_tf2_loads()

_HOMES = {
    'buffer': ['Buffer'],
    'buffer_client': ['BufferClient'],
    'buffer_interface': [
        'BufferInterface', 'convert', 'ConvertRegistration', 'NotImplementedException', 'Stamped',
        'TransformRegistration', 'TypeException'],
    'static_transform_broadcaster': ['StaticTransformBroadcaster'],
    'static_transform_listener': ['StaticTransformListener'],
    'transform_broadcaster': ['TransformBroadcaster'],
    'transform_listener': ['TransformListener'],
}
_HOME_OF = {name: f'{__name__}.{home}' for home, names in _HOMES.items() for name in names}
_HOME_OF |= dict.fromkeys([
    'BufferCore', 'ConnectivityException', 'ExtrapolationException', 'InvalidArgumentException',
    'LookupException', 'TimeoutException', 'TransformException'], 'tf2_py')

__all__ = [*_HOME_OF, *star(__name__)]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return import_module(f'{__name__}.{name}')
    found = getattr(import_module(_HOME_OF[name]) if name in _HOME_OF else imported_names, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*__all__, *_HOMES]
