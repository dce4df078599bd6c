# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers of the tests of the drop-in."""

import os
import subprocess
import sys

from ros_helpers import PATIENCE_S


def run(*arguments, path='', **options):
    """Run Python; the packages on its path are found as if they were installed."""
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(path), os.environ.get('PYTHONPATH', '')])}
    return subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True,
                          env=environment, timeout=PATIENCE_S, check=False, **options)
