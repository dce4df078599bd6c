# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of edges with several sources: a source that was replaced by another."""

from collections.abc import Iterator

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_trouble, Remark
from .finding import Severity


@check(Severity.WARNING, explains=('gap', 'irregular_rate', 'skew', 'delayed'),
       catches='a source of an edge that fell silent and was replaced by another',
       cause='its node or its sensor has died, or hangs; or its clock is behind the others',
       fix='check that source. The edge continued without a jump; when the source works again, '
           'switch back to it, because this is not automatic')
def source_silent(case: Case) -> Iterator[Remark]:
    """Find the incidents of a buffer, here or from the diagnostics of another process."""
    yield from _made_way(case, Kind.SOURCE_SILENT)


@check(Severity.WARNING, explains=('pose_jump',),
       catches='a source that moved differently from the others of its edge, and was replaced',
       cause='wheels that slip, a camera that lost its features, a calibration that is off',
       fix='check that source. Its earlier errors stay in the pose until a localisation corrects '
           'them')
def source_diverged(case: Case) -> Iterator[Remark]:
    """Find the incidents, as ``source_silent`` does."""
    yield from _made_way(case, Kind.SOURCE_DIVERGED)


def _made_way(case: Case, kind: Kind) -> Iterator[Remark]:
    for frames, trouble in case.of_kind(kind):
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]} changed its source '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)
