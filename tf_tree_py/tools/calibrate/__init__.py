# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The report, the picture and the files of ``tf_calibrate``.

The estimate itself is computed in ``tf_tree_py.calibration``.
"""
