# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf_tree_py without compiled formulas, in a process: this process itself has them.

``python -m benchmark.peers.pure`` serves it.
"""

import os
import sys

from tf_tree_py.core import COMPILED

from .ours import OurBuffer
from .remote import RemotePeer, serve_exercises
from ..worker import Worker


def find() -> RemotePeer:
    """
    Return the process.

    :raises ImportError: this process has no compiled formulas either.
    """
    if not COMPILED:
        raise ImportError('tf_tree_py itself runs in pure Python here, because its formulas are '
                          'not compiled or TF_TREE_PY_PURE is set: see docs/installing.md')
    return RemotePeer(Worker([sys.executable, '-m', __name__],
                             {**os.environ, 'TF_TREE_PY_PURE': '1'}))


if __name__ == '__main__':
    serve_exercises(OurBuffer)
