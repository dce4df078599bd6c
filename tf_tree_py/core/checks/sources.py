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

"""Edges that several sources know, and a source that made way to another."""

from collections.abc import Iterator

from .case import Case
from .check import check, of_trouble, Remark
from .finding import Severity
from ..arrivals.incidents import Kind
from ..text import times


@check(Severity.WARNING, explains=('gap', 'irregular_rate', 'skew', 'delayed'),
       catches='a source of an edge that fell silent and made way to another',
       cause='its node or its sensor has died, or hangs; or its clock is behind the others',
       fix='look at that source. The edge went on without a jump; when the source is well again, '
           'switch back to it, for nothing does so by itself')
def source_silent(case: Case) -> Iterator[Remark]:
    """Find what a buffer told of it, here or, by its diagnostics, in another process."""
    yield from _made_way(case, Kind.SOURCE_SILENT)


@check(Severity.WARNING, explains=('pose_jump',),
       catches='a source of an edge that moved otherwise than the others and made way',
       cause='wheels that slip, a camera that lost its features, a calibration that is off',
       fix='look at that source. What it got wrong before stays in the pose until a localisation '
           'takes it out')
def source_diverged(case: Case) -> Iterator[Remark]:
    """Find it likewise."""
    yield from _made_way(case, Kind.SOURCE_DIVERGED)


def _made_way(case: Case, kind: Kind) -> Iterator[Remark]:
    for frames, trouble in case.of_kind(kind):
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]} changed its source '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)
