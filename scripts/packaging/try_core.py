# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The first steps of a new user, in a venv with this package and its dependencies.

python try_core.py [--compiled]: the formulas of lookups must be compiled, or not.
"""

from pathlib import Path
import sys
from xml.etree import ElementTree

import tf_tree_py
from tf_tree_py import BufferCore, Pose
from tf_tree_py.core import COMPILED

MANIFEST = ElementTree.parse(Path(__file__).parents[2] / 'package.xml')


def main() -> None:
    assert tf_tree_py.__version__ == MANIFEST.findtext('version'), tf_tree_py.__version__
    assert (sys.argv[1:] == ['--compiled']) == COMPILED, COMPILED
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
            raise AssertionError(f'{name} is available, but should not be')


if __name__ == '__main__':
    main()
