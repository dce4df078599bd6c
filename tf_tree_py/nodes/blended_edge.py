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

"""What nodes share that publish one edge, which goes over to another pose without a jump."""

from typing import Any

from tf_tree_py.core.geometry.blend import Limits
from tf_tree_py.core.stamp import from_seconds

from .bad_input import BadInput
from .parameters import Setting

LIMITS = (
    Setting('max_speed', 0.2, 'how fast the frame may be moved besides its own motion, m/s',
            (1e-6, 1e6)),
    Setting('max_turn_rate', 0.1, 'how fast it may be turned besides, rad/s', (1e-6, 1e6)),
    Setting('over', 0.3, 'how long it takes at least to go over, seconds', (0.0, 3600.0)),
)


def limits_of(values: dict[str, Any]) -> Limits:
    """Return how the edge may go over, of the parameters in ``LIMITS``."""
    return Limits(from_seconds(values['over']), values['max_speed'], values['max_turn_rate'], 0.0)


def frame_of(values: dict[str, Any], key: str) -> str:
    """
    Return the frame that a parameter names, without a leading slash.

    :raises BadInput: it names none.
    """
    name: str = values[key].removeprefix('/')
    if not name:
        raise BadInput(f'parameter {key} has to be the name of a frame')
    return name
