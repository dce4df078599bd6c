# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joint states as they arrive: moving and constant joints, reports, and tracks of recordings."""

from descriptions import joint, parsed
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import InvalidArgumentException, UNLIMITED
from tf_tree_py.urdf import joint_tracks, JointState, Robot
from tf_tree_py.urdf.joint_states import JointStates

MS = 1_000_000
ARM = (joint('base', 'fixed', 'o', 'a', xyz='5 0 0'), joint('j', 'prismatic', 'a', 'b'),
       joint('k', 'prismatic', 'b', 'c'),
       joint('m', 'prismatic', 'c', 'd', '<mimic joint="k" multiplier="2"/>'))


def into(told):
    return lambda kind, sentence: told.append(sentence)


@pytest.fixture
def told():
    return []


@pytest.fixture
def states(told):
    return JointStates(parsed(*ARM), into(told))


def update(states, ms, interval=None, **positions):
    """Return which of j, k and m to send."""
    rows = states.update(ms * MS, tuple(positions), np.array(list(positions.values())), interval)
    return None if rows is None else ''.join(np.array(list('jkm'))[rows])


def slides(states):
    return states.poses()[:, 0].tolist()


def test_message_moves_whom_it_names_and_whoever_mimics_them(states):
    assert update(states, 0, k=1.0) == 'km'
    assert update(states, 1, j=3.0) == 'jkm'
    assert slides(states) == [3.0, 1.0, 2.0]
    assert update(states, 2, m=7.0, k=0.0, j=0.0) == 'jkm'
    assert slides(states) == [0.0, 0.0, 7.0]


def test_joint_that_is_not_reported_any_more_keeps_its_position(states):
    for ms in (0, 10, 20):
        assert update(states, ms, j=1.0, k=2.0) == 'jkm'
    # For three of its periods, it may come in the next message or from another publisher.
    assert [update(states, ms, j=3.0) for ms in (30, 40, 50, 60)] == ['j', 'j', 'j', 'jkm']
    assert slides(states) == [3.0, 2.0, 4.0]


def test_parts_that_several_publishers_report_go_out_as_they_come(states):
    assert update(states, 0, j=0.0) == 'j'
    update(states, 3, k=0.0)
    update(states, 10, j=0.0)
    assert [update(states, 10 * n + 3, k=0.0) for n in (1, 2)] == ['km', 'km']
    assert [update(states, 10 * n, j=0.0) for n in (2, 3)] == ['j', 'j']


def test_rarely_reported_joint_is_sent_with_the_others(states):
    update(states, 0, k=1.0)
    assert [update(states, ms, j=0.0) for ms in (10, 20)] == ['jkm', 'jkm']
    update(states, 5000, k=2.0)
    assert update(states, 5010, j=0.0) == 'jkm'


def test_joint_is_sent_at_most_at_its_rate(states):
    sent = [update(states, ms, interval=20 * MS, j=float(ms), k=0.0) for ms in range(0, 50, 5)]
    assert [number * 5 for number, rows in enumerate(sent) if rows] == [0, 20, 40]
    assert slides(states)[0] == 45.0


def test_stamps_that_fall_back_far_are_of_another_run(states):
    update(states, 10_000, interval=MS, j=0.0)
    assert update(states, 9_500, interval=MS, j=0.0) is None
    assert update(states, 1_000, interval=MS, j=0.0) == 'j'
    assert update(states, 1_001, interval=MS, j=0.0) == 'j'


def test_names_that_no_joint_has_are_told_once_for_each_list_of_names(states, told):
    for ms in range(3):
        assert update(states, ms, j=1.0, knee=2.0, base=0.0) == 'j'
    assert len(told) == 1 and "that this robot does not have: 'knee'. Known: j, k, m" in told[0]
    assert update(states, 4, elbow=2.0) is None
    assert len(told) == 2


def test_flood_of_names_in_a_recording_is_told_in_bounds():
    told = []
    joint_tracks(parsed(*ARM), [JointState(number * MS, [f'name_{number % 2000}'], [0.0])
                                for number in range(3000)], told.append)
    assert len(told) == len({*told}) == 256


def test_fault_of_a_recording_is_told_once():
    told = []
    joint_tracks(parsed(*ARM), [JointState(number * MS, ['j'], [float('nan')])
                                for number in range(100)], told.append)
    assert told == ["positions that are not finite are ignored, of 'j'"]


def test_bad_positions_leave_the_last_ones(states, told):
    update(states, 0, j=1.0, k=1.0)
    assert update(states, 1, j=float('nan'), k=2.0) == 'jkm'
    assert update(states, 2, j=float('inf')) is None
    assert states.update(3 * MS, ('j',), np.array([])) is None
    assert slides(states) == [1.0, 2.0, 4.0]
    assert told == [*2 * ["positions that are not finite are ignored, of 'j'"],
                    'joint states with 1 names and 0 positions are ignored']


def test_zero_quaternion_is_told_and_left_out(told):
    states = JointStates(parsed(joint('f', 'floating', 'a', 'b')), into(told))
    names = tuple(f'f/rot_{part}' for part in 'xyzw')
    assert states.update(0, names, np.zeros(4)) is None
    assert states.update(0, names, np.array([0.0, 0.0, 1.0, 0.0])).all()
    assert 'quaternion' in told[0]


def test_first_of_two_equal_names_counts(states):
    states.update(0, ('j', 'j'), np.array([1.0, 2.0]))
    assert slides(states)[0] == 1.0


def test_new_description_takes_over_what_was_given(told):
    before = parsed(*ARM)
    states = JointStates(before, into(told))
    assert states.again() is None
    update(states, 7, k=1.0)
    changed = parsed(*ARM[:3], joint('m', 'prismatic', 'c', 'd',
                                     '<mimic joint="k" multiplier="3"/>'))
    other = JointStates(changed, into(told))
    other.resume(states, before)
    stamp, rows = other.again()
    assert (stamp, rows.tolist(), slides(other)) == (7 * MS + 1, [False, True, True], [0, 1, 3])


def test_recorded_joint_states_become_the_moving_edges_of_a_buffer():
    robot = parsed(*ARM)
    stamps = np.arange(1, 101) * 10 * MS
    tracks = joint_tracks(robot, (
        JointState(stamp, ['j', 'k'], [stamp / 1e9, 1.0]) for stamp in stamps))
    buffer = BufferCore(cache_time=UNLIMITED)
    for track in tracks:
        assert buffer.insert_track(*track) == []
    for fixed in robot.joints[:1]:
        buffer.insert(*fixed.edge, 0, fixed.origin, static=True)
    assert [(track.parent, track.child, len(track.stamps)) for track in tracks] == [
        ('a', 'b', 100), ('b', 'c', 100), ('c', 'd', 100)]
    assert buffer.lookup('o', 'd', 505 * MS).x == pytest.approx(5.0 + 0.505 + 3.0)


def test_recorded_joint_has_its_own_stamps_and_positions():
    states = [JointState(ms * MS, ['j', 'k'] if ms <= 50 else ['j'], [ms, ms][:1 + (ms <= 50)])
              for ms in range(10, 101, 10)]
    j, k, _ = joint_tracks(parsed(*ARM), states)
    assert (j.stamps // MS).tolist() == j.poses[:, 0].tolist() == list(range(10, 101, 10))
    # Three periods after its last report, its last position is repeated.
    assert (k.stamps // MS).tolist() == [10, 20, 30, 40, 50, 90, 100]
    assert k.poses[:, 0].tolist() == [10, 20, 30, 40, 50, 50, 50]


def test_recording_without_anything_of_the_robot_has_no_tracks():
    assert joint_tracks(Robot.parse('<robot name="r"><link name="a"/></robot>'), []) == []
    with pytest.warns(UserWarning, match="'x'"):
        assert joint_tracks(parsed(*ARM), [JointState(1, ['x'], [1.0])]) == []
    with pytest.warns(UserWarning, match='1 names and 2 positions'):
        assert joint_tracks(parsed(*ARM), [JointState(1, ['j'], [[1.0, 2.0]])]) == []
    with pytest.raises(InvalidArgumentException, match='stamps are integer nanoseconds'):
        joint_tracks(parsed(*ARM), [JointState(1.5, ['j'], [1.0])])
