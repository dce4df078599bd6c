# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The explanation of a lookup: its result and the sources of it, or the missing data."""

import json
import math

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.reports import explanation_text
from tf_tree_py.reports.explanation import explain, what_is_missing
from tf_tree_py.reports.plain_text import FORMS

SECOND = 10**9


@pytest.fixture
def tree():
    """Return map -> odom -> base -> camera: 1 Hz, 10 Hz from 1 s to 5 s, static."""
    buffer = BufferCore()
    for second in range(1, 5):
        buffer.insert('map', 'odom', second * SECOND, Pose(x=float(second)), authority='/amcl')
    for tick in range(10, 51):
        buffer.insert('odom', 'base', tick * SECOND // 10,
                      Pose.from_xyz_rpy(yaw=0.01 * tick), authority='/wheels')
    buffer.insert('base', 'camera', 0, Pose(z=0.8), static=True, authority='/urdf')
    return buffer


def test_edges_are_told_with_the_samples_around_the_stamp(tree):
    stamp = 3_250_000_000
    told = explain(tree, 'map', 'camera', stamp, now=6 * SECOND)
    assert told.pose == tree.lookup('map', 'camera', stamp)
    assert (told.stamp, told.age, told.problem) == (stamp, 6 * SECOND - stamp, '')
    assert told.frames == ('camera', 'base', 'odom', 'map')
    camera, base, odom = told.edges
    assert (camera.info.static, camera.around, camera.age) == (True, (), None)
    assert base.around == (3_200_000_000, 3_300_000_000)
    assert (base.gap, base.age, base.rate_hz) == (SECOND // 10, SECOND, pytest.approx(10.0))
    assert (base.gone, base.turned) == (0.0, pytest.approx(0.01))
    assert odom.around == (3 * SECOND, 4 * SECOND)
    assert (odom.gone, odom.info.authority, odom.lacks) == (pytest.approx(1.0), '/amcl', 0)
    assert told.slowest is odom


def test_latest_is_told_as_the_stamp_that_it_came_to(tree):
    told = explain(tree, 'map', 'base')
    assert (told.asked, told.stamp, told.age) == (LATEST, 4 * SECOND, None)
    assert [edge.around for edge in told.edges] == [(4 * SECOND,)] * 2
    static = explain(tree, 'base', 'camera', now=SECOND)
    assert (static.stamp, static.age, static.slowest) == (LATEST, None, None)


@pytest.mark.parametrize('stamp, lacks', [
    (4_500_000_000, {'odom': 500_000_000, 'base': 0}),
    (500_000_000, {'odom': -500_000_000, 'base': -500_000_000})])
def test_stamp_without_data_is_told_with_what_each_edge_lacks(tree, stamp, lacks):
    told = explain(tree, 'map', 'base', stamp)
    assert (told.pose, told.stamp) == (None, stamp)
    assert {edge.info.child: edge.lacks for edge in told.edges} == lacks


def test_all_edges_that_are_late_are_named_with_their_senders(tree):
    told = explain(tree, 'map', 'camera', 7 * SECOND)
    assert told.problem == ('map -> odom, odom -> base, sent by /amcl, /wheels, ended 3.000 s '
                            'before the requested stamp')
    early = explain(tree, 'map', 'camera', -SECOND)
    assert early.problem.endswith('begins 2.000 s after the requested stamp')
    clocks = explain(tree, 'map', 'camera', 10**18)
    assert 'use_sim_time' in clocks.problem


def test_unknown_frames_are_told_with_what_may_be_meant(tree):
    told = explain(tree, 'mapp', 'lidar')
    assert told.unknown == (('mapp', 'map'), ('lidar', None))
    assert set(told.known) == {'map', 'odom', 'base', 'camera'}
    assert (told.pose, told.frames, told.edges) == (None, (), ())
    assert '"mapp"' in told.problem


def test_trees_that_are_not_connected_are_a_problem_and_no_unknown_frame(tree):
    tree.insert('mars', 'rover', SECOND, Pose())
    told = explain(tree, 'map', 'rover')
    assert 'not part of the same tree' in told.problem
    assert (told.unknown, told.known, told.edges) == ((), (), ())


def test_edges_that_changed_their_parent_are_told_as_they_were(tree):
    tree.insert('mars', 'base', 6 * SECOND, Pose(x=1.0))
    then = explain(tree, 'map', 'base', 3 * SECOND)
    assert [edge.info.parent for edge in then.edges] == ['odom', 'map']
    assert then.edges[0].around == (3 * SECOND,)


@pytest.mark.parametrize('frames', [('map', 'camera'), ('x', 'y'), ('map', 'map')])
def test_plain_data_has_the_same_keys_always(tree, frames):
    plain = explain(tree, *frames).as_dict()
    assert plain.keys() == explain(tree, 'map', 'base', 2 * SECOND, 3).as_dict().keys()
    json.dumps(plain, allow_nan=False)


def test_other_errors_tell_themselves(tree):
    with pytest.raises(Exception) as caught:
        tree.lookup('map', '')
    assert what_is_missing(tree, caught.value) == str(caught.value)


def test_pose_is_written_in_every_form():
    pose = Pose.from_xyz_rpy(1.0, -2.0, 0.5, yaw=math.pi / 2)
    assert FORMS['rpy'](pose) == (
        'xyz   1.000  -2.000   0.500 m  rpy    0.00    0.00   90.00 deg')
    assert FORMS['quaternion'](pose).endswith('q  0.000000  0.000000  0.707107  0.707107')
    assert FORMS['matrix'](pose).splitlines()[1].split() == [
        '1.000000', '0.000000', '0.000000', '-2.000000']
    everything = FORMS['all'](pose)
    assert FORMS['matrix'](pose) in everything and '1.5708 rad' in everything


# --- uncertainty

def uncertain(tree):
    """Set errors of 1 degree about the camera's y, and of 3 cm along odom's x."""
    tree.insert('base', 'camera', 0, Pose(z=0.8), static=True,
                covariance=np.diag([0.0, 0.0, 0.0, 0.0, math.radians(1.0) ** 2, 0.0]))
    tree.insert('camera', 'thing', 0, Pose(x=5.0), static=True)
    tree.insert('map', 'odom', 2 * SECOND, Pose(x=2.0),
                covariance=np.diag([9e-4, 0.0, 0.0, 0.0, 0.0, 0.0]))


def test_certainty_is_the_worst_direction_and_each_edges_share(tree):
    uncertain(tree)
    stamp = 3_250_000_000
    told = explain(tree, 'map', 'thing', stamp).certainty
    np.testing.assert_array_equal(
        told.covariance, tree.lookup_uncertain('map', 'thing', stamp)[1])
    assert told.position_sigma == pytest.approx(5.0 * math.radians(1.0), rel=1e-3)
    assert told.rotation_sigma == pytest.approx(math.radians(1.0), rel=1e-3)
    assert [share.child for share in told.shares] == ['camera', 'odom']
    lever = (5.0 * math.radians(1.0)) ** 2
    plain = explain(tree, 'map', 'thing', stamp).as_dict()['uncertainty']
    json.dumps(plain, allow_nan=False)
    assert plain['sigma_deg'] == pytest.approx(1.0, rel=1e-3)
    assert plain['shares'] == [
        {'parent': 'base', 'child': 'camera', 'position': pytest.approx(lever / (lever + 9e-4)),
         'rotation': 1.0},
        {'parent': 'map', 'child': 'odom', 'position': pytest.approx(9e-4 / (lever + 9e-4)),
         'rotation': 0.0}]


def test_certainty_in_words(tree):
    uncertain(tree)
    certainty = explain(tree, 'map', 'thing', 3 * SECOND).certainty
    assert explanation_text.sigma(certainty) == '8.73 cm, 1°'
    assert explanation_text.shares(certainty)[0] == (
        'base -> camera', '89% of position, 100% of rotation')


def test_nothing_is_told_of_certainty_where_no_edge_on_the_way_has_any(tree):
    assert explain(tree, 'map', 'camera').certainty is None
    uncertain(tree)
    assert explain(tree, 'odom', 'base').certainty is None
    assert explain(tree, 'map', 'camera', 9 * SECOND).certainty is None
    assert explain(tree, 'map', 'nowhere').as_dict()['uncertainty'] is None
