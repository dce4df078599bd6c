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

"""An explanation in short words, as a terminal and a page show them."""

from math import degrees

from .certainty import Certainty
from .explanation import ExplainedEdge
from ..stamp import format_span


def kind_of(edge: ExplainedEdge) -> str:
    """Return how often an edge comes, or that it never moves."""
    if edge.info.static:
        return 'static'
    return f'{edge.rate_hz:.1f} Hz' if edge.rate_hz else 'one sample'


def around(edge: ExplainedEdge, stamp: int) -> str:
    """Return where the samples lie that a moving edge's pose at a stamp comes from."""
    if edge.lacks > 0:
        return f'ended {format_span(edge.lacks)} before'
    if edge.lacks < 0:
        return f'begins {format_span(-edge.lacks)} after'
    if edge.gap == 0:
        return 'at the stamp'
    before, after = (f'{(knot - stamp) / 1e6:+.1f}' for knot in edge.around)
    return f'{before} {after} ms'


def apart(edge: ExplainedEdge) -> str:
    """Return how far the frame goes and turns between these samples; '' if there are not two."""
    return f'{edge.gone * 100.0:.1f} cm {degrees(edge.turned):.1f}°' if edge.gap else ''


def sigma(certainty: Certainty) -> str:
    """Return the standard deviations, each in its worst direction."""
    return f'{_length(certainty.position_sigma)}, {_angle(certainty.rotation_sigma)}'


def shares(certainty: Certainty) -> list[tuple[str, str]]:
    """Return of each edge with a covariance its name, and its part of both variances."""
    return [(f'{share.parent} -> {share.child}',
             f'{share.position:.0%} of position, {share.rotation:.0%} of rotation')
            for share in certainty.shares]


def _length(metres: float) -> str:
    return f'{metres:.4g} m' if metres >= 1.0 else f'{metres * 100.0:.3g} cm'


def _angle(radians: float) -> str:
    return f'{degrees(radians):.3g}°'
