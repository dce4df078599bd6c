# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A simulated robot whose truth is known: ``python3 -m benchmark.oracle``.

The robot, its odometry and its localiser use numpy and scipy only, and none of the formulas of
tf_tree_py. So they judge what ``Anchor`` and ``lookup_uncertain`` state.
"""

import os

# Before numpy is imported: the matrices are small, and threads would only wait for each other.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
