# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Outgoing transforms: which of many samples are sent, and when.

The caller chooses the transport: a topic, or a link to another machine. ``core.messages.wire``
serializes the messages.
"""
