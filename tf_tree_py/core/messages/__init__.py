# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Incoming transforms: bytes, samples, names, and the incidents that they cause.

This room stores no transforms.
"""
