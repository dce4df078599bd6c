# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf_tree_py with compiled formulas, in a process: a process can import only one tf_tree_py.

``python -m benchmark.peers.compiled`` serves it. ``scripts/bench`` makes the compiled copy of the
sources, and gives its folder in an environment variable.
"""

import os
from pathlib import Path
import sys

from tf_tree_py.core import COMPILED

from .ours import OurBuffer
from .remote import RemotePeer, serve_exercises
from ..worker import Worker, WorkerError

_FOLDER = 'TF_TREE_PY_COMPILED_COPY'


class Compiled(RemotePeer):
    """
    The process.

    :ivar folder: the compiled copy of the sources.
    """

    def __init__(self, folder: Path) -> None:
        """
        Start the process.

        :raises WorkerError: the formulas of the copy are not compiled for this Python.
        """
        super().__init__(Worker([sys.executable, '-m', __name__], folder=folder))
        self.folder = folder
        try:
            self.worker.call('begin', name='probe', task=['chain1', 1.0, False, 1])
        except WorkerError:
            self.worker.close()
            raise


def find() -> Compiled:
    """
    Return the process.

    :raises ImportError: there is no compiled copy; the message contains the remedy.
    """
    folder = os.environ.get(_FOLDER)
    if not folder:
        raise ImportError('scripts/bench could not compile the formulas')
    try:
        return Compiled(Path(folder))
    except WorkerError as error:
        raise ImportError(f'the formulas in {folder} are not compiled for this Python') from error


if __name__ == '__main__':
    if not COMPILED:
        sys.exit(f'the formulas in {os.getcwd()} are not compiled')
    serve_exercises(OurBuffer)
