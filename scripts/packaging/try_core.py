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

"""What a stranger tries first, in a venv that has this package and what it says it needs."""

import sys

import tf_tree_py
from tf_tree_py import BufferCore, Pose


def main() -> None:
    assert tf_tree_py.__version__ == sys.argv[1], tf_tree_py.__version__
    buffer = BufferCore()
    buffer.insert('map', 'base', 1, Pose(x=1.0))
    buffer.insert('base', 'camera', 0, Pose(z=0.8), static=True)
    assert buffer.lookup('map', 'camera', 1) == Pose(x=1.0, z=0.8)
    for name, needed in (('Buffer', 'needs ROS 2'), ('nothing', 'has no attribute')):
        try:
            getattr(tf_tree_py, name)
        except (ImportError, AttributeError) as error:
            assert needed in str(error), error
        else:
            raise AssertionError(f'{name} is here')


if __name__ == '__main__':
    main()
