# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The output of tf2's own C++ program ``tf2_echo`` for an edge, sample by sample."""

import os
from pathlib import Path
import re

import numpy as np
from programs import Program
from standin import standin_env

_ECHOED = re.compile(r'At time (\d+)\.(\d+)\n- Translation: \[(.+), (.+), (.+)\]')


class Tf2Echo(Program):
    """``tf2_echo`` of an edge; without an installed Jazzy the test skips."""

    def __init__(self, parent, child, rate_hz=50):
        env = standin_env()
        places = (Path(folder, 'lib', 'tf2_ros', 'tf2_echo')
                  for folder in env['AMENT_PREFIX_PATH'].split(os.pathsep))
        program = next(str(place) for place in places if place.exists())
        super().__init__(program, parent, child, str(rate_hz), env=env)

    @property
    def samples(self):
        """Return stamps (N,), seconds, and positions (N, 3), to the millimetre."""
        echoed = np.array(_ECHOED.findall(self.output), dtype=float).reshape(-1, 5)
        # It prints nanoseconds without leading zeros.
        return echoed[:, 0] - echoed[:1, 0] + echoed[:, 1] / 1e9, echoed[:, 2:]

    def assert_no_faster(self, speed):
        """Assert that no pair of samples is faster than a speed, metres a second."""
        stamps, places = self.samples
        for begin, end in zip(*np.triu_indices(len(stamps), 1), strict=True):
            assert np.linalg.norm(places[end] - places[begin]) <= (
                speed * abs(stamps[end] - stamps[begin]) + 2e-3)
