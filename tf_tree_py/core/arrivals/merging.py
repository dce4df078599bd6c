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

"""Tables of counts put together: those of two buffers, or of two parts of a recording."""

from collections.abc import Hashable, Mapping
from typing import Any, Protocol, TypeVar


class Addable(Protocol):
    """What can be added to another of its kind, in any order."""

    def __add__(self, other: Any, /) -> Any:
        """Return the two together."""


Key = TypeVar('Key', bound=Hashable)
Value = TypeVar('Value', bound=Addable)


def merged(*tables: Mapping[Key, Value]) -> dict[Key, Value]:
    """
    Return one table of all: values that have the same key are added.

    The values are ``Arrivals`` by edge, ``IncidentGroup`` by kind and edge, or plain
    counts. Which tables are merged first makes no difference.
    """
    together: dict[Key, Value] = {}
    for table in tables:
        for key, value in table.items():
            together[key] = together[key] + value if key in together else value
    return together
