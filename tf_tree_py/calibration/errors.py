# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The exception of this package."""


class CalibrationError(ValueError):
    """A calibration is not possible: one sentence with the reason and the remedy."""
