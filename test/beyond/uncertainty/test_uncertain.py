# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Covariance through the tree: lookups, budgets, cancellation, and cost."""

import pickle

import numpy as np
import pytest
from strategies import random_pose
from tf_tree_py import BufferCore
from tf_tree_py.beyond.uncertainty.covariance_history import EdgeCovariances
from tf_tree_py.beyond.uncertainty.covariances import carried, composed
from tf_tree_py.beyond.uncertainty.insertion import insert_covariance
from tf_tree_py.core import ExtrapolationException, Kind, Pose, se3
from tf_tree_py.core.errors import InvalidArgumentException, LookupException
from tf_tree_py.core.geometry.so3 import as_matrix
from tf_tree_py.core.tree.tree import Tree
from uncertain_trees import (
    assert_explained,
    drawn_poses,
    errors_of,
    random_covariance,
    RandomTree,
)

SECOND = 1_000_000_000


def edges_with_covariances(buffer):
    known = buffer.intake.tree.companion(EdgeCovariances)
    return {} if known is None else known.by_edge


@pytest.mark.parametrize('degrees', [0.2, 1.0, 5.0, 20.0])
@pytest.mark.parametrize('seed', range(3))
def test_every_entry_is_what_draws_say(degrees, seed):
    rng = np.random.default_rng([seed, int(10 * degrees)])
    tree = RandomTree(rng, int(rng.integers(4, 8)), degrees)
    target, source = rng.permutation(['f0', *tree.edges])[:2].tolist()
    pose, covariance = tree.buffer.lookup_uncertain(target, source)
    assert pose == tree.buffer.lookup(target, source)
    assert_explained(covariance, tree.drawn(target, source))


@pytest.mark.parametrize('lever', [1.0, 10.0])
def test_first_order_lacks_the_squares_of_the_angles(lever):
    """They only matter in a direction of which much is known: see the page uncertainty."""
    buffer, yaw = BufferCore(), np.radians(0.99)**2
    edge = np.diag([1e-12, 1e-12, 1e-12, 0.0, 0.0, yaw])
    buffer.insert('map', 'base', 0, Pose(), static=True, covariance=edge)
    buffer.insert('base', 'tool', 0, Pose(x=lever), static=True)
    pose, covariance = buffer.lookup_uncertain('map', 'tool')
    drawn = se3.compose_many(drawn_poses(np.random.default_rng(1), se3.IDENTITY, edge),
                             np.array(Pose(x=lever)))
    along = (errors_of(drawn, pose)[:, 0]**2).mean()
    assert 1000.0 * covariance[0, 0] < along < covariance[0, 0] + (0.9 * lever * yaw)**2


@pytest.mark.parametrize('seed', range(3))
def test_covariance_is_that_of_gtsam(seed):
    gtsam = pytest.importorskip(
        'gtsam', reason='the second oracle is GTSAM: pip install gtsam')
    rng = np.random.default_rng(seed)
    tree = RandomTree(rng, 7, 0.1)
    target, source = rng.permutation(['f0', *tree.edges])[:2].tolist()

    def pose3(pose):
        return gtsam.Pose3(np.array(se3.as_matrix(pose)))

    def in_tangent_space(pose, covariance):
        # GTSAM's errors are E Exp(xi), rotation first.
        turn = np.kron(np.eye(2), np.array(as_matrix(pose[3:])).T)
        order = [3, 4, 5, 0, 1, 2]
        return (turn @ covariance @ turn.T)[np.ix_(order, order)]

    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    names = ['f0', *tree.edges]
    for number, name in enumerate(names):
        values.insert(number, pose3(tree.buffer.lookup(target, name)))
    for child, (parent, pose, covariance) in tree.edges.items():
        known = 1e-14 * np.eye(6) if covariance is None else in_tangent_space(pose, covariance)
        graph.add(gtsam.BetweenFactorPose3(names.index(parent), names.index(child), pose3(pose),
                                           gtsam.noiseModel.Gaussian.Covariance(known)))
    graph.add(gtsam.PriorFactorPose3(names.index(target), gtsam.Pose3(),
                                     gtsam.noiseModel.Isotropic.Sigma(6, 1e-7)))
    theirs = gtsam.Marginals(graph, values).marginalCovariance(names.index(source))
    pose, ours = tree.buffer.lookup_uncertain(target, source)
    np.testing.assert_allclose(in_tangent_space(pose, ours), theirs, atol=1e-4 * theirs.max())


# --- the convention

def test_one_edge_is_its_own_covariance_and_backwards_it_is_turned_round():
    rng = np.random.default_rng(3)
    pose, covariance = random_pose(rng, 2.0), random_covariance(rng, 0.01, 0.001)
    buffer = BufferCore()
    buffer.insert('map', 'base', 0, pose, static=True, covariance=covariance)
    np.testing.assert_allclose(buffer.lookup_uncertain('map', 'base')[1], covariance, rtol=1e-12)
    turn = np.array(as_matrix(pose[3:])).T
    zero = np.zeros((3, 3))
    cross = np.cross(np.eye(3), pose[:3]).T
    inverse = -np.block([[turn, turn @ cross.T], [zero, turn]])
    np.testing.assert_allclose(buffer.lookup_uncertain('base', 'map')[1],
                               inverse @ covariance @ inverse.T, rtol=1e-9)


def test_rotation_about_a_childs_origin_moves_only_what_it_carries():
    buffer = BufferCore()
    buffer.insert('map', 'base', 0, Pose(x=10.0), static=True,
                  covariance=np.diag([0.0, 0.0, 0.0, 0.0, 0.0, 1e-6]))
    buffer.insert('base', 'tool', 0, Pose(x=3.0), static=True)
    assert not buffer.lookup_uncertain('map', 'base')[1][:3].any()
    covariance = buffer.lookup_uncertain('map', 'tool')[1]
    assert covariance[1, 1] == pytest.approx(9e-6) and covariance[1, 5] == pytest.approx(3e-6)
    # In the inverse, the parent rotates: map as seen from base, 10 m away.
    assert buffer.lookup_uncertain('base', 'map')[1][1, 1] == pytest.approx(1e-4)


def test_error_above_the_meeting_point_drops_out():
    rng = np.random.default_rng(4)
    buffer = BufferCore()
    hand, eye = random_covariance(rng, 0.001, 0.001), random_covariance(rng, 0.002, 0.002)
    buffer.insert('map', 'base', 1, Pose(x=50.0), covariance=random_covariance(rng, 1.0, 0.01))
    buffer.insert('base', 'hand', 0, Pose(y=0.3), static=True, covariance=hand)
    buffer.insert('base', 'eye', 0, Pose(z=0.5), static=True, covariance=eye)
    pose, covariance = buffer.lookup_uncertain('eye', 'hand')
    expected = carried(np.eye(3), np.array([0.0, 0.3, -0.5]), eye) + hand
    np.testing.assert_allclose(covariance, expected, rtol=1e-12)
    assert [share.child for share in buffer.lookup_budget('eye', 'hand')] == ['eye', 'hand']


def test_shares_add_up_and_the_largest_is_first():
    buffer = BufferCore()
    buffer.insert('map', 'base', 0, Pose(), static=True, covariance=np.diag([1e-4] * 3 + [0] * 3))
    buffer.insert('base', 'arm', 0, Pose(z=1.0), static=True)
    buffer.insert('arm', 'camera', 0, Pose.from_xyz_rpy(x=0.2, yaw=1.0), static=True,
                  covariance=np.diag([0.0] * 3 + [1e-5] * 3))
    buffer.insert('camera', 'object', 0, Pose(x=5.0), static=True)
    _, covariance = buffer.lookup_uncertain('map', 'object')
    first, second = buffer.lookup_budget('map', 'object')
    assert (first.parent, first.child, first.rotation) == ('arm', 'camera', 1.0)
    assert (second.child, second.rotation) == ('base', 0.0)
    assert first.position == pytest.approx(5e-4 / 8e-4)
    np.testing.assert_allclose(first.covariance + second.covariance, covariance, atol=1e-15)
    assert buffer.lookup_budget('base', 'arm') == buffer.lookup_budget('map', 'map') == []


def test_yaw_of_which_nothing_is_known_is_as_unsure_as_half_a_turn_allows():
    """A variance of 1e6 or more is that of any yaw: pi^2 / 3; its children may be anywhere."""
    for variance in (1e3, 1e6, 1e12):
        buffer = BufferCore()
        buffer.insert('map', 'base', 0, Pose(), static=True,
                      covariance=np.diag([1e-4] * 3 + [0.0, 0.0, variance]))
        buffer.insert('base', 'camera', 0, Pose(x=1.0), static=True)
        covariance = buffer.lookup_uncertain('map', 'camera')[1]
        assert covariance[5, 5] == pytest.approx(np.pi ** 2 / 3, rel=0.1)
        # About the pose itself: the mean of (1 - cos)^2 is 3 / 2, that of sin^2 is 1 / 2.
        np.testing.assert_allclose(covariance.diagonal()[:2], [1.5, 0.5], rtol=0.1)
        assert covariance[2, 2] == pytest.approx(1e-4, rel=0.1)
        many = buffer.lookup_uncertain_many('map', 'camera', [0, 1])[1]
        np.testing.assert_allclose(many, np.stack([covariance] * 2), rtol=1e-9, atol=1e-15)


# --- over time

def moving(step=20_000_000, covariance=True):
    buffer = BufferCore(cache_time=100 * SECOND)
    rng = np.random.default_rng(5)
    for number, stamp in enumerate(range(0, 2 * SECOND + 1, step)):
        buffer.insert('odom', 'base', stamp, Pose.from_xyz_rpy(x=0.1 * number, yaw=0.1 * number),
                      covariance=(1 + number) * np.diag([1e-4] * 3 + [1e-8] * 3)
                      if covariance else None)
    buffer.insert('base', 'camera', 0, random_pose(rng), static=True,
                  covariance=random_covariance(rng, 0.01, 0.001))
    return buffer


@pytest.mark.parametrize('independent', [False, True])
def test_many_stamps_are_one_by_one(independent):
    buffer = moving()
    buffer.insert('map', 'odom', 5, Pose(y=3.0), covariance=np.eye(6) * 1e-8)
    buffer.insert('map', 'odom', 2 * SECOND, Pose(y=3.1))
    stamps = np.random.default_rng(6).integers(5, 2 * SECOND, 40)
    for ends in (('map', 'camera'), ('camera', 'map'), ('base', 'odom'), ('camera', 'camera')):
        poses, covariances = buffer.lookup_uncertain_many(*ends, stamps, independent=independent)
        for stamp, pose, covariance in zip(stamps.tolist(), poses, covariances, strict=True):
            found, alone = buffer.lookup_uncertain(*ends, stamp, independent=independent)
            np.testing.assert_allclose(pose, found, atol=1e-12)
            np.testing.assert_allclose(covariance, alone, rtol=1e-9, atol=1e-18)
    poses, covariances = buffer.lookup_uncertain_many('map', 'camera', [])
    assert poses.shape == (0, 7) and covariances.shape == (0, 6, 6)


@pytest.mark.parametrize('independent', [False, True])
@pytest.mark.parametrize('ends', [('odom', 'camera'), ('camera', 'odom')])
def test_shares_between_two_samples_add_up_and_the_pose_is_that_of_lookup(ends, independent):
    buffer, stamp = moving(), 1_007_000_000
    pose, covariance = buffer.lookup_uncertain(*ends, stamp, independent=independent)
    assert pose == buffer.lookup(*ends, stamp)
    budget = buffer.lookup_budget(*ends, stamp, independent=independent)
    assert {share.child for share in budget} == {'base', 'camera'}
    np.testing.assert_allclose(
        sum(share.covariance for share in budget), covariance, rtol=1e-9, atol=1e-15)
    assert sum(share.position for share in budget) == pytest.approx(1.0)


def test_between_two_samples_it_is_blended_or_averaged():
    buffer = BufferCore()
    for stamp in (0, 100):
        buffer.insert('odom', 'base', stamp, Pose(x=0.01 * stamp), covariance=np.eye(6) * 1e-6)
    alike = buffer.lookup_uncertain('odom', 'base', 50)[1]
    apart = buffer.lookup_uncertain('odom', 'base', 50, independent=True)[1]
    np.testing.assert_allclose(alike, np.eye(6) * 1e-6, rtol=1e-12)
    np.testing.assert_allclose(apart, np.eye(6) * 0.5e-6, rtol=1e-12)
    at_its_end = buffer.lookup_uncertain('odom', 'base', 100, independent=True)[1]
    np.testing.assert_allclose(at_its_end, np.eye(6) * 1e-6, rtol=1e-12)


@pytest.mark.parametrize('pose_between', [False, True])
def test_turn_between_two_samples_counts_if_it_is_one_turn(pose_between):
    """With a pose between them, the two covariances do not determine the errors in between."""
    rng = np.random.default_rng(7)
    ends = [Pose(), Pose.from_rotation_vector((0.8, -0.6, 0.9), (1.0, 0.0, 0.0))]
    covariances = [random_covariance(rng, 0.01, 0.005) for _ in ends]
    buffer = BufferCore()
    for stamp, pose, covariance in zip((0, 100), ends, covariances, strict=True):
        buffer.insert('odom', 'base', stamp, pose, covariance=covariance)
    if pose_between:
        buffer.insert('odom', 'base', 50, Pose(y=3.0))
        expected = 0.6 * covariances[0] + 0.4 * covariances[1]
        np.testing.assert_allclose(buffer.lookup_uncertain('odom', 'base', 40)[1], expected)
        return
    drawn = [drawn_poses(rng, pose, covariance)
             for pose, covariance in zip(ends, covariances, strict=True)]
    found, covariance = buffer.lookup_uncertain('odom', 'base', 40, independent=True)
    assert_explained(covariance, errors_of(
        se3.interpolate_many(*drawn, np.full(len(drawn[0]), 0.4)), found))


def test_covariance_holds_before_the_first_and_until_another_comes():
    buffer = moving(covariance=False)
    for stamp, variance in ((SECOND, 1.0), (3 * SECOND // 2, 3.0)):
        insert_covariance(
            buffer.intake, 'odom', 'base', stamp, np.eye(6) * variance * 1e-9, 'test')
    stamps = np.array([1, SECOND, 5 * SECOND // 4, 3 * SECOND // 2, 2 * SECOND])
    variances = buffer.lookup_uncertain_many('odom', 'base', stamps)[1][:, 0, 0]
    np.testing.assert_allclose(variances, np.array([1.0, 1.0, 2.0, 3.0, 3.0]) * 1e-9)


def test_latest_is_the_newest_that_all_edges_have():
    buffer = moving()
    found, covariance = buffer.lookup_uncertain('odom', 'camera')
    np.testing.assert_array_equal(
        covariance, buffer.lookup_uncertain('odom', 'camera', 2 * SECOND)[1])


def test_covariance_of_one_parent_is_not_that_of_another():
    buffer = BufferCore()
    buffer.insert('table', 'cup', 10, Pose(), covariance=np.eye(6) * 1e-6)
    buffer.insert('table', 'cup', 20, Pose())
    buffer.insert('gripper', 'cup', 30, Pose(), strict=False)
    buffer.insert('gripper', 'cup', 40, Pose())
    assert buffer.lookup_uncertain('table', 'cup', 15)[1].any()
    assert not buffer.lookup_uncertain('gripper', 'cup', 35)[1].any()
    many = buffer.lookup_uncertain_many('table', 'cup', [12, 15])[1]
    np.testing.assert_allclose(many, np.tile(np.eye(6) * 1e-6, (2, 1, 1)))
    buffer.insert('gripper', 'cup', 50, Pose(), covariance=np.eye(6) * 1e-4)
    assert buffer.lookup_uncertain('table', 'cup', 15)[1].any(), 'an answer that was given'
    np.testing.assert_allclose(
        buffer.lookup_uncertain('gripper', 'cup', 35)[1], np.eye(6) * 1e-4)


def test_old_covariances_go_with_the_window_and_the_last_of_them_holds():
    buffer = BufferCore(cache_time=SECOND)
    for number in range(5_000):
        buffer.insert('odom', 'base', number * 10_000_000, Pose(), covariance=np.eye(6) * 1e-9)
    assert 100 <= len(edges_with_covariances(buffer)['odom', 'base']) <= 180
    assert buffer.lookup_uncertain('odom', 'base', 49 * SECOND)[1].any()


# --- changes of the tree

def test_snapshot_keeps_them_and_can_be_pickled():
    buffer = moving()
    still = buffer.snapshot()
    expected = buffer.lookup_uncertain('odom', 'camera')
    buffer.clear()
    buffer.insert('base', 'camera', 0, Pose(), static=True, covariance=np.zeros((6, 6)))
    for one in (still, still.snapshot(), pickle.loads(pickle.dumps(still))):
        assert one.lookup_uncertain('odom', 'camera')[0] == expected[0]
        np.testing.assert_array_equal(one.lookup_uncertain('odom', 'camera')[1], expected[1])


def test_clearing_forgets_covariances_of_moving_edges():
    buffer = moving()
    buffer.clear()
    assert list(edges_with_covariances(buffer)) == [('base', 'camera')]
    assert buffer.lookup_uncertain('base', 'camera')[1].any()
    buffer.remove_frame('camera')
    assert not edges_with_covariances(buffer)


def test_of_a_refused_sample_nothing_stays():
    buffer = moving()
    old = buffer.lookup_uncertain('odom', 'base')[1]
    refused = buffer.insert('camera', 'odom', SECOND, Pose(), strict=False,
                            covariance=np.eye(6))
    assert refused[0].refused and (
        'camera', 'odom') not in edges_with_covariances(buffer)
    with pytest.raises(InvalidArgumentException, match='not positive semidefinite'):
        buffer.insert('odom', 'base', 3 * SECOND, Pose(), covariance=np.ones((6, 6)) - np.eye(6))
    np.testing.assert_array_equal(buffer.lookup_uncertain('odom', 'base')[1], old)


def test_strangers_cannot_fill_the_memory_with_names():
    buffer = BufferCore(max_frames=5, max_name_bytes=20)
    taken = [insert_covariance(buffer.intake, 'odom', name, 1, np.eye(6), 'stranger') for name in (
        'a', 'b' * 21, 'c', 'd\0', 'e', 'f', 'g', 'h', 'a')]
    kinds = [incidents[0].kind if incidents else None for incidents in taken]
    assert kinds == [None, Kind.BAD_NAME, None, Kind.BAD_NAME, None, None, None,
                     Kind.TOO_MANY_FRAMES, None]
    assert len(edges_with_covariances(buffer)) == 5 and buffer.statistics().refused == 3


def test_errors_are_those_of_lookup():
    buffer = moving()
    for ask in (buffer.lookup_uncertain, buffer.lookup_budget):
        with pytest.raises(ExtrapolationException, match='looking up transform from frame'):
            ask('odom', 'camera', 3 * SECOND)
        with pytest.raises(LookupException, match='does not exist'):
            ask('odom', 'nobody')
    with pytest.raises(ExtrapolationException, match='1 of 2 stamps have no answer'):
        buffer.lookup_uncertain_many('odom', 'camera', [SECOND, 3 * SECOND])
    with pytest.raises(InvalidArgumentException, match='integer nanoseconds'):
        buffer.lookup_uncertain_many('odom', 'camera', [0.5])
    pose, covariance = buffer.lookup_uncertain('odom', 'odom')
    assert pose == Pose() and not covariance.any()


def test_detection_with_a_covariance_of_its_own_is_composed():
    buffer = moving()
    camera, of_camera = buffer.lookup_uncertain('odom', 'camera')
    seen, of_seen = Pose(z=4.0), np.eye(6) * 1e-9
    buffer.insert('camera', 'seen', 0, seen, static=True, covariance=of_seen)
    np.testing.assert_allclose(composed(camera, of_camera, seen, of_seen),
                               buffer.lookup_uncertain('odom', 'seen')[1], rtol=1e-9)


def test_tree_without_them_keeps_nothing_of_the_kind():
    """
    Neither a tree nor a history has an attribute that almost none of them needs.

    The first covariance adds it to a tree. A copy of a tree without covariances has none either.
    """
    buffer = moving(covariance=False)
    buffer.remove_frame('camera')
    for tree in (Tree(SECOND, 9, 9), Tree(SECOND, 9, 9).copy()):
        assert not tree.companions
    assert not hasattr(buffer.intake.tree.histories['base'], '__dict__')
    insert_covariance(buffer.intake, 'odom', 'base', 1, np.eye(6), 'test')
    assert list(edges_with_covariances(buffer)) == [('odom', 'base')]
