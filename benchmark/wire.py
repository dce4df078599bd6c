# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A TFMessage as a publisher's middleware writes it."""

from collections.abc import Sequence

from tf_tree_py.core import Sample
from tf_tree_py.core.arrivals.wire import write

from .motion import Edge, Pose, pose_at


def message_at(edges: Sequence[Edge], sample: int) -> bytes:
    """Return the bytes of one message with the samples of these edges."""
    stamps = [edge.stamp_of(sample) for edge in edges]
    return message(edges, stamps, list(map(pose_at, edges, stamps)))


def message(edges: Sequence[Edge], stamps: Sequence[int], poses: Sequence[Pose]) -> bytes:
    """Return the bytes of one message."""
    return write([Sample(edge.parent, edge.child, stamp, pose)
                  for edge, stamp, pose in zip(edges, stamps, poses, strict=True)])
