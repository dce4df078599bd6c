# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All tests of this folder need rosbags."""

from importlib.util import find_spec

import numpy as np
import pytest

collect_ignore_glob = [] if find_spec('rosbags') else ['test_*.py']


@pytest.fixture
def rng():
    """Return a generator of random numbers, the same ones for each test."""
    return np.random.default_rng(7)
