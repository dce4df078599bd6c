# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The short texts of an explanation, for a terminal and a page."""

from math import degrees

from tf_tree_py.beyond.uncertainty.noise import EdgeNoise
from tf_tree_py.core.stamp import format_span

from .explanation import Certainty, ExplainedEdge


def rate_of(edge: ExplainedEdge) -> str:
    """Return the rate of an edge, or that it is static."""
    if edge.info.static:
        return 'static'
    return f'{edge.rate_hz:.1f} Hz' if edge.rate_hz else 'one sample'


def around(edge: ExplainedEdge, stamp: int) -> str:
    """Return how far the samples around a stamp are from it."""
    if edge.lacks > 0:
        return f'ended {format_span(edge.lacks)} before'
    if edge.lacks < 0:
        return f'begins {format_span(-edge.lacks)} after'
    if edge.gap == 0:
        return 'at the stamp'
    before, after = (f'{(knot - stamp) / 1e6:+.1f}' for knot in edge.around)
    return f'{before} {after} ms'


def apart(edge: ExplainedEdge) -> str:
    """Return how far the frame moves between these samples; '' if there are not two."""
    return f'{edge.gone * 100.0:.1f} cm {degrees(edge.turned):.1f}°' if edge.gap else ''


def noise_of(noise: EdgeNoise | None) -> str:
    """Return the standard deviations of an edge's noise; '' if it is unknown."""
    if noise is None:
        return ''
    millimetres, angle = 1000.0 * noise.position_sigma, degrees(noise.rotation_sigma)
    return f'{_rounded(millimetres)} mm {_rounded(angle)}°'


def sigma(certainty: Certainty) -> str:
    """Return the standard deviations, each in its worst direction."""
    return f'{_length(certainty.position_sigma)}, {_angle(certainty.rotation_sigma)}'


def shares(certainty: Certainty) -> list[tuple[str, str]]:
    """Return the name of each edge with a covariance, and its part of both variances."""
    return [(f'{share.parent} -> {share.child}',
             f'{share.position:.0%} of position, {share.rotation:.0%} of rotation')
            for share in certainty.shares]


def _length(metres: float) -> str:
    return f'{metres:.4g} m' if metres >= 1.0 else f'{metres * 100.0:.3g} cm'


def _rounded(number: float) -> str:
    # Rounding errors of the poses are not noise.
    return f'{number:.0f}' if number >= 10.0 else f'{round(number, 3):.2g}'


def _angle(radians: float) -> str:
    return f'{degrees(radians):.3g}°'
