# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.buffer."""

from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401

__all__ = ['Buffer', *star(__name__)]
