# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The serialized form of a TFMessage."""

from collections.abc import Sequence

from tf_tree_py.core import Sample
from tf_tree_py.core.messages.wire import write

from .motion import Edge, Pose, pose_at


def message_at(edges: Sequence[Edge], sample: int) -> bytes:
    """Return the bytes of one message with a sample of each of these edges."""
    stamps = [edge.stamp_of(sample) for edge in edges]
    return message(edges, stamps, list(map(pose_at, edges, stamps)))


def message(edges: Sequence[Edge], stamps: Sequence[int], poses: Sequence[Pose]) -> bytes:
    """Return the bytes of one message."""
    return write([Sample(edge.parent, edge.child, stamp, pose)
                  for edge, stamp, pose in zip(edges, stamps, poses, strict=True)])
