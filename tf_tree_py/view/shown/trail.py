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

"""Where a frame has been."""

import numpy as np
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.tree.queries import Queries

# More points than this are no smoother on a screen.
_MOST = 400


def trail(tree: Queries, fixed_frame: str, frame: str, begin: int, end: int) -> Array:
    """
    Return where a frame was in the fixed one, from one stamp to another.

    :return: (N, 2, 3) metres, a piece of the way each; a gap where there was no data.
    """
    stamps = np.linspace(begin, end, _MOST).round().astype(np.int64)
    try:
        poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    except TransformException:
        return np.empty((0, 2, 3))
    pieces = np.stack([poses[:-1, :3], poses[1:, :3]], axis=1)
    return pieces[valid[:-1] & valid[1:]]
