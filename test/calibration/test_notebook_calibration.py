# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The notebook from a bag to a mounting and an offset runs unchanged."""

import os
from pathlib import Path
import re
import subprocess
import sys

from programs import PATIENCE_S
import pytest

NOTEBOOK = Path(__file__).parents[2] / 'examples' / 'notebook_calibration.py'


def test_notebook_finds_both_faults(tmp_path):
    pytest.importorskip('matplotlib')
    pytest.importorskip('rosbags')
    done = subprocess.run(
        [sys.executable, NOTEBOOK], cwd=tmp_path, text=True, check=False, timeout=PATIENCE_S,
        env={**os.environ, 'MPLBACKEND': 'agg'}, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert 'The verdict: edge and time\n' in done.stdout
    assert re.search(r'stamps are (59|60)\.\d ms late', done.stdout)
    assert re.search(r'moved by (19|20|21) mm and 1\.0 degrees', done.stdout)
    assert 'Not visible' not in done.stdout
    assert (tmp_path / 'late_camera.png').read_bytes().startswith(b'\x89PNG')
