# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The entry point of ``tf_view``."""

from tf_tree_py.command.starting import starter

tf_view = starter(f'{__package__}.tf_view')
