# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""How a listener receives transforms, as data: to compare it with how ``tf_share`` does."""

from collections.abc import Collection

from rclpy.node import Node
from tf_tree_py.frame_names import FrameFilter
from tf_tree_py.shared.directory import Reception

from ..threads.internal_node import USE_SIM_TIME

TOPICS, STATIC_ONLY = 'topics', 'static_only'


def reception_of(node: Node, *, tf_topic: str, tf_static_topic: str, static_only: bool,
                 frame_prefix: str, strip_frame_prefix: str, shared_frames: Collection[str],
                 frame_filter: FrameFilter | None) -> Reception:
    """Return the options of a ``TransformListener``, with the names that the node resolves."""
    renames = bool(frame_prefix or strip_frame_prefix)
    wanted = (None if frame_filter is None else 'a function' if callable(frame_filter)
              else sorted(set(frame_filter)))
    return {
        'domain_id': node.context.get_domain_id(),
        TOPICS: [*map(node.resolve_topic_name, (tf_topic, tf_static_topic))],
        USE_SIM_TIME: bool(node.get_parameter(USE_SIM_TIME).value),
        STATIC_ONLY: static_only,
        'frame_prefix': frame_prefix,
        'strip_frame_prefix': strip_frame_prefix,
        'shared_frames': sorted(set(shared_frames)) if renames else [],
        'frame_filter': wanted,
    }


def difference(ours: Reception, theirs: Reception) -> str:
    """Return what the other process does otherwise, as a clause; '' if nothing."""
    for name, value in ours.items():
        other = theirs.get(name)
        if other != value:
            return f'it has {name}={other!r}, and this listener has {value!r}'
    return ''
