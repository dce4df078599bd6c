# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Single samples of an edge whose stamps are far from all others, by the order of arrival.

A gap in both stamps and arrivals is a pause. Many samples on both sides of a step are two runs, or
two clocks. Neither has lone stamps.
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamps

from .sample_rows import Mask, Places

Edge = TypeVar('Edge')

# A lone stamp is at least so far from those before and after it, nanoseconds; and so many times as
# far as the arrivals differ, and as the stamps before and after it do.
_FAR, _TIMES = from_seconds(60.0), 10.0
# At the first or last sample, so many steps beside it are small.
_BESIDE = 3
# A larger part of an edge's samples is no exception.
_MOST = 0.05
# Steps that are longer than so many short ones, of this quantile, do not show the pace of a
# simulation.
_LONG, _SHORT = 100.0, 0.2

_NONE = np.empty(0, np.intp)


class FarSteps(NamedTuple):
    """
    What the far steps between the stamps of an edge mean.

    :ivar between: the places of lone stamps between others.
    :ivar ends: the places of the first and the last stamp, if they are far from those beside them.
    :ivar back: whether a step at these ends goes back, as where time begins anew.
    :ivar others: whether there are other far steps, such as from one run to another.
    """

    between: Places = _NONE
    ends: Places = _NONE
    back: bool = False
    others: bool = False


def lone_stamps_of(edges: Mapping[Edge, tuple[Stamps, Stamps]]) -> dict[Edge, Places]:
    """
    Return the places of lone stamps of each edge that has some, sorted.

    Without known arrivals there are none, because a pause looks the same. If time begins anew in
    a recording, the first and last samples of its edges are not judged, because they may be all
    that is left of another run.

    :param edges: for each edge, (N,) when each sample arrived, nanoseconds, 0 if it is not known;
        and (N,) its stamp, nanoseconds, in order of arrival.
    """
    found = {edge: far_steps(*columns) for edge, columns in edges.items()}
    anew = any(steps.others for steps in found.values()) or (
        len(found) > 1 and all(steps.back for steps in found.values()))
    places = {edge: steps.between if anew else np.sort(np.concatenate(
        [steps.between, steps.ends])) for edge, steps in found.items()}
    return {edge: lone for edge, lone in places.items() if len(lone)}


def far_steps(received: Stamps, stamps: Stamps) -> FarSteps:
    """Return what the far steps mean; the parameters are those of an edge."""
    known = np.flatnonzero(received > 0)
    moments = stamps[known].astype(float)
    steps = np.diff(moments)
    if not len(steps) or np.abs(steps).max() <= _FAR:
        return FarSteps()
    far = _far(steps, np.abs(np.diff(received[known].astype(float))))
    between, ends = _between(moments, far), _ends(far)
    if len(between) + len(ends) > max(1.0, _MOST * len(moments)):
        return FarSteps(others=True)
    # The step at the last place is the one before it.
    back = steps[np.minimum(ends, len(steps) - 1)] < 0.0
    return FarSteps(known[between], known[ends], bool(back.any()),
                    int(far.sum()) > 2 * len(between) + len(ends))


def _far(steps: Array, waited: Array) -> Mask:
    """Return which steps are far, (N - 1,): also compared with the pace of a simulation."""
    sizes = np.abs(steps)
    usual = sizes <= max(_FAR, _LONG * float(np.quantile(sizes, _SHORT, method='lower')))
    if not waited[usual].any():
        return np.zeros(len(steps), np.bool_)
    pace = max(1.0, float(sizes[usual].sum() / waited[usual].sum()))
    far: Mask = sizes > np.maximum(_FAR, _TIMES * pace * waited)
    return far


def _between(moments: Array, far: Mask) -> Places:
    """Return the places after and before which a far step is, but none beside these."""
    beside = np.concatenate([[False], far, [False]])
    alone = beside[1:-2] & beside[2:-1] & ~beside[:-3] & ~beside[3:]
    apart = np.abs(moments[2:] - moments[:-2])
    size = np.minimum(np.abs(moments[1:-1] - moments[:-2]), np.abs(moments[2:] - moments[1:-1]))
    lone: Places = np.flatnonzero(alone & (_TIMES * apart <= size)) + 1
    return lone


def _ends(far: Mask) -> Places:
    """Return the first and the last place, if only the step at it is far."""
    if len(far) < _BESIDE:
        return _NONE
    first = far[0] and not far[1:1 + _BESIDE].any()
    last = far[-1] and not far[-1 - _BESIDE:-1].any()
    return np.array([0] * bool(first) + [len(far)] * bool(last), np.intp)
