# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Why a lookup has no answer, in words for the operator of a robot."""

from tf_tree_py.core.errors import ExtrapolationException, TransformException
from tf_tree_py.core.stamp import format_span, from_seconds
from tf_tree_py.core.tree.outline import EdgeInfo
from tf_tree_py.core.tree.queries import Queries

# Data this far behind is not late: its stamps come from another clock.
_ANOTHER_CLOCK = from_seconds(3600.0)


def what_is_missing(tree: Queries, error: TransformException) -> str:
    """
    Return why a lookup failed; for a stamp, all edges that ended before it.

    The error itself names one of them.
    """
    if not isinstance(error, ExtrapolationException) or error.requested is None:
        return str(error)
    asked = error.requested
    late = [edge for edge in _moving_edges(tree, error) if edge.latest < asked]
    if late:
        edges = ', '.join(f'{edge.parent} -> {edge.child}' for edge in late)
        senders = ', '.join(sorted({edge.authority for edge in late if edge.authority}))
        gap = asked - min(edge.latest for edge in late)
        by = f', sent by {senders}' if senders else ''
        fact = f'{edges}{by}, ended {format_span(gap)} before'
    elif error.oldest is not None and error.oldest > asked:
        gap = error.oldest - asked
        fact = f'{error.parent} -> {error.child} begins {format_span(gap)} after'
    else:  # the data has arrived since
        return str(error)
    hint = '; do both use the same clock (use_sim_time)?' if gap > _ANOTHER_CLOCK else ''
    return f'{fact} the requested stamp{hint}'


def _moving_edges(tree: Queries, error: TransformException) -> list[EdgeInfo]:
    """Return the moving edges between the two frames, beginning at the target."""
    if error.source_frame is None or error.target_frame is None:
        return []
    try:
        edges = tree.edges_between(error.source_frame, error.target_frame)
    except TransformException:  # they are no longer connected
        return []
    return [edge for edge in edges if not edge.static]
