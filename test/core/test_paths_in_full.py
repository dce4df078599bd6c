# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Paths between frames, and the edges as data, in whole results worked out by hand.

``test_oracle`` and ``test_rehanging`` compare the poses of random trees.
"""

import math

import numpy as np
from policies import HoldNewest
import pytest
from tf_tree_py.core import (
    EdgeInfo,
    FutureExtrapolationException,
    PastExtrapolationException,
    Pose,
)
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.stamp import BEGINNING, FOREVER
from tf_tree_py.core.tree.edge_info import (
    counted,
    info_at,
    info_of,
    samples_around,
    stamps_of,
    summary,
)
from tf_tree_py.core.tree.path import edge_to_blame, latest_common, Path, Step


def place(number):
    return (float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def moving(child, *stamps, parent='p', cache_time=100, holds_for=0):
    """Return a history whose poses are as many metres along x as their stamps."""
    history = Samples(child, cache_time, f'of {child}')
    if holds_for:
        history.interpolate_by(HoldNewest(holds_for))
    for stamp in stamps:
        history.insert(stamp, parent, place(stamp))
    return history


def rehung():
    """Return a history that was at p, q, and p again, and ended at 50."""
    history = Samples('c', 1000, 'node')
    for stamp, parent in ((10, 'p'), (20, 'p'), (30, 'q'), (40, 'p'), (50, 'p')):
        history.insert(stamp, parent, place(stamp))
    history.end()
    return history


STATIC = StaticHistory('lens', 'camera', place(7), 'calibration')


# --- edges as data


def test_stamps_of_each_kind_of_edge():
    for history, stamps in ((None, []), (STATIC, []), (Samples('c', 5), []),
                            (moving('c', 5), [5]), (moving('c', 1, 5, 9, cache_time=3), [5, 9])):
        found = stamps_of(history)
        assert (found.tolist(), found.dtype) == (stamps, np.int64)


def test_samples_around_a_stamp_have_their_own_stamps():
    history = moving('c', 10, 20, 20, 30)
    for stamp, around in ((-5, [10]), (9, [10]), (10, [10]), (11, [10, 20]), (20, [20]),
                          (25, [20, 30]), (29, [20, 30]), (30, [30]), (31, [30])):
        found = samples_around(history, stamp)
        assert found == [(knot, Pose(*place(knot))) for knot in around]
        assert all(type(pose) is Pose for _, pose in found)
    for history in (None, STATIC, Samples('c', 5)):
        assert samples_around(history, 5) == []

    class Wide(Samples):
        """Another kind of edge, whose tracks are longer than they need be."""

        def track(self, first, last):
            return super().track(self.oldest_stamp, self.newest_stamp)

    history = Wide('c', 100)
    for stamp in (10, 20, 30, 40):
        history.insert(stamp, 'p', place(stamp))
    for stamp, around in ((20, [20]), (21, [20, 30]), (29, [20, 30]), (30, [30]), (50, [40])):
        assert [knot for knot, _ in samples_around(history, stamp)] == around


def test_edge_as_data():
    assert info_of('p', moving('c', 1, 5, 9)) == EdgeInfo('p', 'c', 'of c', False, 3, 1, 9)
    assert info_of('x', Samples('c', 5)) == EdgeInfo('x', 'c', '', False, 0, 0, 0)
    assert info_of('camera', STATIC) == EdgeInfo('camera', 'lens', 'calibration', True, 1, 0, 0)
    info = EdgeInfo('p', 'c', '', False, 5, 100, 2_000_000_100)
    assert (info.span, info.interval, info.rate_hz) == (2_000_000_000, 5e8, 2.0)
    info = EdgeInfo('p', 'c', '', False, 1, 100, 100)
    assert (info.span, info.interval, info.rate_hz) == (0, 0.0, 0.0)


def test_edge_at_a_moment_has_the_interval_with_that_parent():
    history = rehung()
    for moments, parent, oldest, latest in (
            ((10, 19, 20, 29), 'p', 10, 20), ((30, 39), 'q', 30, 30), ((40, 50), 'p', 40, 50)):
        for moment in moments:
            assert info_at(parent, history, moment) == EdgeInfo(
                parent, 'c', 'node', False, 5, oldest, latest)
    assert info_at('camera', STATIC, 15) == info_of('camera', STATIC)
    for moment in (None, 15):
        assert info_at('p', moving('c', 10, 20), moment).oldest == 10
    assert info_at('p', history, None) == EdgeInfo('p', 'c', 'node', False, 5, 10, 50)


def test_tree_in_one_line():
    still = EdgeInfo('a', 'b', '', True, 1, 0, 0)
    one = EdgeInfo('b', 'c', '', False, 2, 3_000_000_000, 4_500_000_000)
    two = EdgeInfo('b', 'd', '', False, 2, 1_000_000_000, 2_000_000_000)
    for frames, edges, text in (
            (0, [], 'empty'), (1, [], '1 frame, 0 edges (0 static)'),
            (2, [still], '2 frames, 1 edge (1 static)'),
            (4, [one, still, two],
             '4 frames, 3 edges (1 static), 1.000000000 to 4.500000000 s')):
        assert summary(frames, edges) == text
    assert [counted(number, 'edge') for number in range(3)] == ['0 edges', '1 edge', '2 edges']


# --- paths


def test_path_has_the_steps_from_the_target_to_the_source():
    up, down = [moving('a', 1, 9), STATIC], [moving('t', 2, 8, parent='x')]
    path = Path(up, down)
    steps = [Step('x', down[0], True), Step('camera', STATIC, False), Step('p', up[0], False)]
    assert path.steps() == steps
    assert path.steps() is path.steps()
    assert (path.span(), path.latest_common_time()) == ((2, 8), 8)
    assert path.slowest_edges() == down
    assert path.without_data(5) == []
    assert path.without_data(9) == down
    assert path.without_data(0) == [up[0], *down]
    assert path.pose_at(5) == pytest.approx(place(7 + 5 - 5))


def test_tracks_of_a_path_have_the_samples_around_two_stamps():
    path = Path([moving('a', *range(0, 100, 10))], [moving('b', *range(5, 100, 20)), STATIC])
    down, up = path.tracks(22, 38)
    assert [track.knots.tolist() for track in (*down, *up)] == [[20, 30, 40], [], [5, 25, 45]]


def test_path_is_fixed_if_no_edge_changes_its_parent():
    fixed, changing = moving('a', 1, 2), rehung()
    for source, target, above, expected in (
            ([fixed], [STATIC], [], (True, True)), ([changing], [], [], (False, False)),
            ([], [changing], [], (False, False)), ([], [fixed], [changing], (True, False)),
            ([], [fixed], [fixed, changing], (True, False)), ([fixed], [], [STATIC], (True, True)),
            ([], [], [], (True, True)), ([fixed, changing], [], [], (False, False))):
        path = Path(source, target, above)
        assert (path.fixed, path.for_good) == expected
    assert Path([fixed], []).for_good


def test_path_of_static_edges_is_valid_at_all_times():
    path = Path([STATIC], [])
    assert (path.span(), path.latest_common_time(), path.slowest_edges()) == (
        (BEGINNING, FOREVER - 1), 0, [])
    assert Path([], []).pose_at(5) == se3.IDENTITY


def edges_down(kinds):
    """Return edges from the leaf up: static ones (s) and moving ones (m), each 1, 10, 100 m."""
    return [StaticHistory(f'f{i}', f'f{i + 1}', place(10 ** i)) if kind == 's' else constant(i)
            for i, kind in enumerate(kinds)]


def constant(i):
    history = Samples(f'f{i}', 100)
    for stamp in (0, 9):
        history.insert(stamp, f'f{i + 1}', place(10 ** i))
    return history


@pytest.mark.parametrize('source', ['', 's', 'm', 'ss', 'sms', 'mssm', 'ssmss'])
@pytest.mark.parametrize('target', ['', 'm', 'ss', 'ssm', 'mss'])
def test_path_has_each_step_and_successive_static_edges_are_one_part(source, target):
    up, down = edges_down(source), edges_down(target)
    path = Path(up, down)
    assert [step.history.sample(5) for step in path.steps()] == [
        place(10 ** i) for i in (*range(len(down)), *reversed(range(len(up))))]
    assert path.pose_at(5)[0] == sum(10 ** i for i in range(len(up))) - sum(
        10 ** i for i in range(len(down)))
    for parts, edges, kinds in zip(path.tracks(2, 7), (up, down), (source, target), strict=True):
        assert len(parts) == kinds.count('m') + sum(len(run) > 0 for run in kinds.split('m'))
        assert math.fsum(part.at(np.array([5]))[0, 0] for part in parts) == sum(
            10 ** i for i in range(len(edges)))


def test_static_edges_are_composed_in_their_order():
    quarter = math.sqrt(0.5)
    turn = (1.0, 0.0, 0.0, 0.0, 0.0, quarter, quarter)
    path = Path([StaticHistory('c', 'b', place(1)), StaticHistory('b', 'a', turn)], [])
    assert path.pose_at(0) == pytest.approx((1.0, 1.0, 0.0, 0.0, 0.0, quarter, quarter))


def test_latest_common_stamp():
    a, b, held, longer = (moving('a', 1, 9), moving('b', 1, 5), moving('h', 1, 3, holds_for=4),
                          moving('l', 1, 2, holds_for=30))
    for edges, common in (
            ([], 0), ([Samples('c', 5)], 0), ([a], 9), ([a, b], 5), ([b, a], 5),
            ([a, Samples('c', 5)], 9), ([held], 3), ([held, b], 5), ([held, a], 7),
            ([a, held, Samples('c', 5)], 7), ([held, longer], 3), ([longer, a], 9),
            ([Samples('c', 5), held, longer], 3)):
        assert latest_common(edges) == common
    assert Path([a, held], []).slowest_edges() == [held]
    assert Path([held, longer], []).slowest_edges() == [held]
    assert Path([longer, a], []).slowest_edges() == [a]


def test_edge_to_blame_is_the_one_that_is_lost_then_the_one_that_is_late():
    lost, older = moving('lost', 150, 300), moving('older', 120, 210)
    fresh = moving('fresh', 170, 180)
    young, empty = moving('young', 110, 115), Samples('empty', 100)
    late, later = moving('late', 50, 90), moving('later', 50, 80)
    for edges, stamp, blamed in (
            ([lost, older, young], 100, lost), ([young, older, lost], 100, lost),
            ([older, lost], 90, lost),  # both are lost; of that, the first sample is newer
            ([young, empty], 100, young), ([empty, young], 100, young),
            ([late, later], 100, later), ([later, late], 100, later), ([late, empty], 100, empty),
            ([fresh, lost], 90, lost), ([lost, fresh], 90, lost),
            ([young, later], 100, young), ([later, young, older], 100, older)):
        assert edge_to_blame(edges, stamp) is blamed


def test_failure_names_the_worst_edge_and_all_that_may_help():
    a, b = moving('a', 100, 200), moving('b', 100, 150)
    path = Path([a], [b])
    for stamp, cls, child, blocked in (
            (210, FutureExtrapolationException, 'b', (('a', 210), ('b', 210))),
            (160, FutureExtrapolationException, 'b', (('a', 201), ('b', 160))),
            # Both have no sample so old, but b may still get one.
            (99, PastExtrapolationException, 'a', None)):
        for given in (a, b):
            error = given.extrapolation(stamp)
            found = path.failure(stamp, error)
            assert (type(found), found.child, found.blocked_on) == (cls, child, blocked)
            assert (found is error) == (given.child == child)
