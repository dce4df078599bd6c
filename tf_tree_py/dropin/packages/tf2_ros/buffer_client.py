# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.buffer_client."""

from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.ros.remote.buffer_client import BufferClient

__all__ = ['BufferClient', *star(__name__)]
