# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The parts of ``tf_calibrate``: its report, its picture, its files, and the live recording.

The estimate itself is computed in ``tf_tree_py.calibration``.
"""
