# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the observations do not show keeps the tree's value exactly, and is called what it is."""

from calibration_scenes import at, EDGE, errors, PLACE, scene
from hypothesis import given, strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tf_tree_py import BufferCore, screws
from tf_tree_py.calibration import calibrate, Limits, Observations, Verdict
from tf_tree_py.core import Pose, se3, UNLIMITED
from tf_tree_py.tools.calibrate.report import advice, hidden

NEAR = Limits(max_offset_s=0.2)
BASE_T_MAST = Pose.from_xyz_rpy(x=0.1, z=0.8, yaw=0.3)
BOTH = [('base', 'mast'), ('mast', 'camera')]


def with_mast(drive, turns=None):
    """
    Return the tree of a scene with a mast between base and camera.

    :param turns: the yaw of the mast at each second; None: it is static.
    """
    stamps = drive.buffer.stamps_of('base')
    tree = BufferCore(cache_time=UNLIMITED)
    tree.insert_track('map', 'base', stamps, drive.buffer.lookup_many('map', 'base', stamps))
    tree.insert('base', 'mast', 0, BASE_T_MAST, static=True)
    if turns is not None:
        tree.insert_track('mast', 'head', stamps, screws.exp_many(np.stack(
            [np.zeros(len(stamps))] * 5 + [turns], axis=1)))
    tree.insert('mast' if turns is None else 'head', 'camera', 0,
                BASE_T_MAST.inverse() @ drive.buffer.lookup(*EDGE), static=True)
    return tree


def kept(found):
    """Return how far the kept directions of all edges moved."""
    moved = []
    for each in found.unobservable:
        if each.kind in ('translation', 'rotation') or (each.kind == 'both'
                                                        and found.time_offsets):
            edge = next(edge for edge in found.edges
                        if (edge.parent, edge.child) == (each.parent, each.child))
            change = errors(edge.after, edge.before)
            moved.append((change[3:] if each.kind == 'rotation' else change[:3]) @ each.axis)
    return np.abs(moved)


@given(seed=st.integers(0, 10**6), turning=st.sampled_from([0.0, 0.02, 0.1]),
       driving=st.sampled_from([0.02, 0.3]), noise=st.sampled_from([0.002, 0.02]),
       planar=st.booleans(), points=st.booleans(), place=st.booleans(), time=st.booleans(),
       mast=st.booleans())
def test_what_is_not_observable_keeps_the_value_of_the_tree(
        seed, turning, driving, noise, planar, points, place, time, mast):
    drive = scene(seed, 60, offset_s=0.0, turned_deg=6.0, moved_m=0.1, turning=turning,
                  driving=driving, planar=planar, points=points, noise_m=noise, noise_rad=noise,
                  duration_s=8.0)
    sets = Observations('camera', drive.observations.stamps, drive.observations.seen, 'map',
                        place=PLACE[:drive.observations.seen.shape[1]] if place else None)
    found = calibrate(with_mast(drive) if mast else drive.buffer, BOTH if mast else EDGE, sets,
                      time=time, limits=NEAR)
    assert kept(found).max(initial=0.0) < 1e-9
    assert len(found.unobservable) >= 6 * mast
    assert np.linalg.eigvalsh(found.covariance)[0] > 0.0


@pytest.mark.parametrize('moved_m, verdict', [(0.05, Verdict.EDGE), (0.0, Verdict.NOTHING)])
def test_only_the_product_of_two_static_edges_is_observable(moved_m, verdict):
    drive = scene(1, offset_s=0.0, turned_deg=3.0 * (moved_m > 0.0), moved_m=moved_m)
    found = calibrate(with_mast(drive), BOTH, drive.observations, time=True, limits=NEAR)
    assert found.verdict is verdict
    assert hidden(found) == [
        'only the product of base -> mast and mast -> camera is observable: choose one of them '
        "with --edge. Here, base -> mast keeps the tree's value"]
    assert not any('turn' in sentence or 'record' in sentence for sentence in advice(found, True))
    first, second = found.edges
    assert first.after == pytest.approx(BASE_T_MAST, abs=1e-12)
    product = first.after @ second.after
    alone = calibrate(drive.buffer, EDGE, drive.observations, time=True, limits=NEAR).edge
    assert errors(product, alone.after) == pytest.approx(np.zeros(6), abs=1e-4)
    # The error of the first edge, which is as in Limits, moves the second.
    assert (np.sqrt(np.diag(second.covariance)) > 0.0999).all()


def test_one_of_the_two_edges_alone_is_observable():
    drive = scene(1, offset_s=0.0, moved_m=0.05)
    found = calibrate(with_mast(drive), BOTH[1], drive.observations, time=True, limits=NEAR)
    assert not found.unobservable and found.verdict is Verdict.EDGE


def test_joint_between_two_edges_shows_some_of_them_apart():
    drive = scene(1)
    stamps, taken = drive.buffer.stamps_of('base'), drive.observations.stamps
    tree = with_mast(drive, 0.8 * np.sin((stamps - stamps[0]) / 1e9))
    noise = screws.exp_many(np.random.default_rng(1).normal(scale=0.002, size=(len(taken), 6)))
    seen = se3.compose_many(se3.inverse_many(tree.lookup_many('map', 'camera', taken)),
                            np.tile(PLACE, (len(taken), 1)))
    tree.insert('head', 'camera', 0, tree.lookup('head', 'camera') @ Pose.from_xyz_rpy(
        x=0.03, yaw=0.05), static=True)
    found = calibrate(tree, [('base', 'mast'), ('head', 'camera')], Observations(
        'camera', taken, se3.compose_many(seen, noise), 'map'), time=True, limits=NEAR)
    assert 0 < len(found.unobservable) < 6 and kept(found).max() < 1e-9
    for sentence in hidden(found):
        assert 'apart from' in sentence and 'move the joints between the two edges' in sentence


def test_camera_in_the_room_asks_the_hand_to_turn():
    """The parent of the edge rests, so its turn is no remedy."""
    drive = scene(4, 120, planar=True, offset_s=0.0)
    tree = drive.buffer
    tree.insert('map', 'eye', 0, PLACE @ Pose.from_xyz_rpy(x=0.05), static=True)
    sets = Observations('eye', drive.observations.stamps,
                        se3.inverse_many(drive.observations.seen), 'base', 'marker')
    found = calibrate(tree, ('map', 'eye'), sets, limits=NEAR)
    assert found.unobservable
    assert all('turn base about' in each.remedy for each in found.unobservable)


def straight(way, edge, place=None):
    """
    Return the tree and the observations of a robot that only drives ahead, and of a marker.

    :param way: the place of the robot (N,) at seconds (N,).
    :param edge: what the tree has for base -> camera; its true rotation is the identity.
    """
    buffer, seconds = BufferCore(cache_time=UNLIMITED), np.arange(0.0, 12.0, 0.02)
    poses = np.zeros((len(seconds), 7))
    poses[:, 0], poses[:, 6] = way(seconds), 1.0
    buffer.insert_track('map', 'base', at(seconds), poses)
    buffer.insert('base', 'camera', 0, edge, static=True)
    taken = np.arange(1.0, 11.0, 0.1)
    seen = np.tile((3.0, 0.5, 0.2, 0.0, 0.0, 0.0, 1.0), (len(taken), 1))
    seen[:, 0] -= way(taken)
    seen[:, :3] += 0.002 * np.random.default_rng(1).normal(size=(len(taken), 3))
    return buffer, Observations('camera', at(taken), seen if place else seen[:, :3], 'map',
                                place=place)


def test_without_time_the_stamps_count_as_right():
    buffer, sets = straight(lambda seconds: 0.5 * seconds, Pose(x=0.04, z=0.5),
                            (3.0, 0.5, 0.7, 0.0, 0.0, 0.0, 1.0))
    found = calibrate(buffer, EDGE, sets, limits=NEAR)
    assert found.edge.after.x == pytest.approx(0.0, abs=0.002) and not found.time_offsets
    [sentence] = hidden(found)
    assert 'apart from the time of camera: the stamps count as right' in sentence


def test_axis_of_a_hidden_rotation_counts_from_a_tree_that_is_far_off():
    """A robot that only drives ahead does not show the rotation about its x axis."""
    buffer, sets = straight(lambda seconds: 2.0 * np.sin(seconds),
                            Pose.from_xyz_rpy(x=0.04, z=0.5, roll=0.5, pitch=0.4, yaw=0.6))
    found = calibrate(buffer, EDGE, sets, limits=NEAR)
    [axis] = [each.axis for each in found.unobservable if each.kind == 'rotation']
    step = Rotation.from_rotvec(errors(found.edge.after, found.edge.before)[3:])
    hidden_turn = Rotation.from_rotvec(step.as_rotvec() + 1e-6 * np.array(axis)) * step.inv()
    assert abs(hidden_turn.as_rotvec()[1:]).max() < 1e-9 and np.degrees(step.magnitude()) > 30.0
