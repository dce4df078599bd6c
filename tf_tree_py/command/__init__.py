# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What every command line needs: arguments, signals, tables, JSON.

It imports only the standard library, and rich for tables. It does not depend on frames or ROS.
"""
