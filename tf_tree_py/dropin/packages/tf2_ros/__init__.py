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

"""Names of tf2_ros, backed by tf_tree_py; each is loaded when it is first used."""

from importlib import import_module
from typing import Any

from tf_tree_py.dropin import imported_names

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

__all__ = [*_HOME_OF, *imported_names.NAMES]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return import_module(f'{__name__}.{name}')
    found = getattr(import_module(_HOME_OF[name]) if name in _HOME_OF else imported_names, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*__all__, *_HOMES]
