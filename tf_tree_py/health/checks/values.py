# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks for numbers and bytes that are not valid transforms."""

from collections.abc import Iterator

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_edge, of_trouble, Remark
from .finding import Severity


@check(Severity.ERROR,
       catches='NaN or infinity in a transform',
       cause='a division by zero, or a filter that has diverged, in the node that sends it',
       fix='fix the publisher; every buffer refuses such a transform, so the edge does not move')
def not_finite(case: Case) -> Iterator[Remark]:
    """Find transforms that the buffer refused because of NaN or infinity."""
    for edge, trouble in case.of_kind(Kind.NOT_FINITE):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} was NaN or infinite '
                         f'{times(trouble.count)}', trouble)


@check(Severity.WARNING,
       catches='quaternions whose length is not one',
       cause='a quaternion that was averaged or integrated and not normalised; or Euler angles '
             'that were put into its fields',
       fix='normalise before sending: each buffer does so too, but not every consumer')
def not_normalised(case: Case) -> Iterator[Remark]:
    """Find quaternions whose length is not one; the buffer refuses those of length zero."""
    for edge, moving in case.moving():
        motion = moving.motion
        if motion.off_length:
            yield of_edge(
                edge, f'has quaternions of length {motion.worst_length:.4g}, {motion.off_length} '
                f'of {moving.timing.count}',
                {'count': motion.off_length, 'samples': moving.timing.count,
                 'worst_length': motion.worst_length})
    for frames, trouble in case.of_kind(Kind.ZERO_ROTATION):
        yield of_trouble(
            frames, f'{frames[0]} -> {frames[1]} has an all-zero quaternion, and was refused '
            f'{times(trouble.count)}', trouble, evidence={'worst_length': 0.0},
            severity=Severity.ERROR, cause='a message whose rotation was not set',
            fix='for no rotation send x 0, y 0, z 0, w 1')


@check(Severity.ERROR,
       catches='messages that cannot be read, and invalid frame names',
       cause='a different message type on the topic, a damaged recording, or a name from '
             'uninitialised memory',
       fix='check the publisher that the evidence names, and the messages that it sends')
def unreadable(case: Case) -> Iterator[Remark]:
    """Find messages and names that the buffer refused."""
    for frames, trouble in case.of_kind(Kind.MALFORMED, Kind.BAD_NAME, Kind.TOO_MANY_FRAMES):
        yield of_trouble(tuple(filter(None, frames)),
                         f'refused {times(trouble.count)}: {trouble.detail}', trouble)
