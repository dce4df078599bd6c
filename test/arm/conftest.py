# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""PyBullet simulates the arm; without it, the tests of this folder skip."""

from importlib.util import find_spec

if find_spec('pybullet') is None:
    collect_ignore_glob = ['test_arm_*.py']
