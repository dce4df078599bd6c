# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Incoming transforms: bytes, samples, and incidents.

What is refused, and why; the observers that are notified of it. This room stores no transforms.
"""
