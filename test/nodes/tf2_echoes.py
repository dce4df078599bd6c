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

"""What tf2's own C++ program ``tf2_echo`` says of an edge, sample by sample."""

import os
from pathlib import Path
import re

import numpy as np
from programs import Program
from standin import standin_env

_ECHOED = re.compile(r'At time (\d+)\.(\d+)\n- Translation: \[(.+), (.+), (.+)\]')


class Tf2Echo(Program):
    """It listens to an edge; without an installed Jazzy the test skips."""

    def __init__(self, parent, child, rate_hz=50):
        env = standin_env()
        places = (Path(folder, 'lib', 'tf2_ros', 'tf2_echo')
                  for folder in env['AMENT_PREFIX_PATH'].split(os.pathsep))
        program = next(str(place) for place in places if place.exists())
        super().__init__(program, parent, child, str(rate_hz), env=env)

    @property
    def samples(self):
        """Return stamps (N,), seconds, and places (N, 3), to the millimetre."""
        echoed = np.array(_ECHOED.findall(self.output), dtype=float).reshape(-1, 5)
        # It writes nanoseconds without the zeros before them.
        return echoed[:, 0] - echoed[:1, 0] + echoed[:, 1] / 1e9, echoed[:, 2:]

    def assert_no_faster(self, speed):
        """Hold every pair of samples to a speed, metres a second."""
        stamps, places = self.samples
        for begin, end in zip(*np.triu_indices(len(stamps), 1), strict=True):
            assert np.linalg.norm(places[end] - places[begin]) <= (
                speed * abs(stamps[end] - stamps[begin]) + 2e-3)
