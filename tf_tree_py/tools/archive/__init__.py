# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Many bags at once, on dask: a task, a row and files for each.

The result for each bag is the doctor's report, or an export.
"""
