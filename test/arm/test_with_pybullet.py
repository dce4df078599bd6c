# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The other files of this folder are only collected if PyBullet is installed."""

import pytest


def test_the_arm_is_tested_here():
    pytest.importorskip('pybullet', reason='the arm is tested in the venv of scripts/arm')
