# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf_tree_py with compiled formulas, in a process: this process itself computes in Python.

``python -m benchmark.peers.compiled`` serves it.
"""

import os
import sys

from tf_tree_py.core import COMPILED

from .ours import OurBuffer
from .remote import RemotePeer, serve_exercises
from ..worker import Worker, WorkerError


def environment() -> dict[str, str]:
    """Return that of this process, but with compiled formulas."""
    return {name: value for name, value in os.environ.items() if name != 'TF_TREE_PY_PURE'}


def find() -> RemotePeer:
    """
    Return the process.

    :raises ImportError: this Python has no compiled formulas.
    """
    peer = RemotePeer(Worker([sys.executable, '-m', __name__], environment()))
    try:
        peer.worker.call('begin', name='probe', task=['chain1', 1.0, False, 1])
    except WorkerError as error:
        peer.worker.close()
        raise ImportError('no compiled formulas were built: see docs/installing.md') from error
    return peer


if __name__ == '__main__':
    if not COMPILED:
        sys.exit('the formulas are not compiled')
    serve_exercises(OurBuffer)
