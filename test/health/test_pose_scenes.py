# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is said about poses that jump, are too fast, or should not move, beside each limit."""

import numpy as np
from small_scenes import every, fixed, poses, said, sent
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.doctor import Doctor

NANOSECOND = 1e-9
PLACES = np.arange(60)


def short(code, *messages, **others):
    """Return the severities of findings, each with its edges."""
    return [one.partition(' | ')[0] for one in said(code, *messages, **others)]


def moving(edges, at, period=0.1, node='', begin=0.0):
    return sent(edges, every(period, len(at), begin), at=at, node=node)


def drive(count=60, step=0.05):
    return poses(count, x=step * np.arange(count), yaw=0.02 * np.arange(count))


def jumping(gone=4.0, turned=0.0, count=60, place=30, step=0.05):
    """Return poses that drive, and jump once."""
    later = np.arange(count) >= place
    return poses(count, x=step * np.arange(count) + gone * later,
                 yaw=0.02 * np.arange(count) + turned * later)


# --- pose_jump

def test_jump_of_a_robot():
    assert said('pose_jump', moving('odom base', jumping(), node='/wheels')) == [
        'warning odom>base | /wheels | odom -> base jumped once, at most by 4.05 m and 1.15 deg '
        'in 100 ms after 1700000002.900000000 s | count=1 after_stamp_s=1700000002.9 time_s=0.1 '
        'gone_m=4.05 turned_deg=1.14592 speed_m_s=40.5 turn_rate_deg_s=11.4592']
    assert said('pose_jump', moving('odom base', jumping(0.0, 2.9))) == []
    assert said('pose_jump', moving('odom base', jumping(0.0, 3.0), 0.05)) == [
        'warning odom>base | odom -> base jumped once, at most by 0.05 m and 173 deg in 50 ms '
        'after 1700000001.450000000 s | count=1 after_stamp_s=1700000001.45 time_s=0.05 '
        'gone_m=0.05 turned_deg=173.033 speed_m_s=1 turn_rate_deg_s=3460.67']
    assert said('pose_jump', moving('odom base', drive())) == []


def test_several_jumps_are_one_finding_of_the_largest():
    at = jumping()
    at[45:, 0] += 7.0
    assert said('pose_jump', moving('odom base', at)) == [
        'warning odom>base | odom -> base jumped twice, at most by 7.05 m and 1.15 deg in 100 ms '
        'after 1700000004.400000000 s | count=2 after_stamp_s=1700000004.4 time_s=0.1 '
        'gone_m=7.05 turned_deg=1.14592 speed_m_s=70.5 turn_rate_deg_s=11.4592']


def test_jump_is_no_finding_if_many_steps_are_as_fast():
    steps = np.where(PLACES < 40, 0.01, 2.0)
    once, back = steps.copy(), steps.copy()
    once[20], back[20:22] = 1.5, (1.5, -1.5)
    for code, moved in (('pose_jump', once), ('outlier', back), ('interpolated_jump', once)):
        found = [short(code, moving('odom base', poses(count, x=np.cumsum(moved[:count]),
                                                       yaw=0.02 * np.arange(count))))
                 for count in (60, 40)]
        assert found == [[], ['warning odom>base']]


def test_jump_of_an_edge_that_rests_is_of_a_mounting():
    at = poses(60, x=np.where(PLACES < 30, 1.0, 5.0), yaw=np.where(PLACES < 30, 0.0, 0.5))
    assert said('pose_jump', moving('base arm', at)) == []
    assert said('moved_once', moving('base arm', at)) == [
        'note base>arm | base -> arm rests, but moved once, by 4 m and 28.6 deg, after '
        '1700000002.900000000 s | count=1 after_stamp_s=1700000002.9 time_s=0.1 gone_m=4 '
        'turned_deg=28.6479']


def localised(at, base=None, children='base tool', period=0.1):
    """Return a localiser, odometry, and what is below it."""
    below = [moving(children, poses(60, yaw=0.05 * PLACES))] if children else []
    return [moving('map odom', at, period), moving(
        'odom base', drive() if base is None else base), *below]


def test_jump_of_a_localiser_is_a_note():
    corrected = poses(60, x=np.where(PLACES < 30, 0.0, 4.0), yaw=0.0)
    assert said('pose_jump', *localised(corrected)) == [
        'note map>odom | map -> odom jumped once, at most by 4 m and 0 deg in 100 ms after '
        '1700000002.900000000 s | count=1 after_stamp_s=1700000002.9 time_s=0.1 gone_m=4 '
        'turned_deg=0 speed_m_s=40 turn_rate_deg_s=0 | cause: a correction of the localiser, '
        'which may jump: the edge below it moves smoothly | fix: plan and control in odom; only '
        'goals belong in map']
    # Not if what is below only turns, and has nothing below it.
    wheel = poses(60, yaw=0.05 * PLACES)
    assert short('pose_jump', *localised(corrected, wheel, '')) == [
        'warning map>odom']
    assert short('pose_jump', *localised(corrected, wheel)) == [
        'note map>odom']
    assert [short('pose_jump', *localised(corrected, poses(60, x=np.where(
        PLACES == 59, far, 0.0), yaw=0.05 * PLACES), '')) for far in (0.1, 0.101)] == [
        ['warning map>odom'], ['note map>odom']]
    fast = moving('odom base', jumping(8.0, step=0.5)), moving('base arm', drive(step=0.01))
    assert short('pose_jump', *fast) == [
        'warning odom>base']


# --- outlier

def outlying(places=(30,), count=60, gone=5.0, turned=0.0):
    at = drive(count)
    away = np.isin(np.arange(count), places)
    return poses(count, x=at[:, 0] + gone * away, yaw=0.02 * np.arange(count) + turned * away)


def test_single_samples_far_from_the_others():
    assert said('outlier', moving('odom base', outlying(), node='/wheels')) == [
        'warning odom>base | /wheels | odom -> base has 1 of 60 samples that are far from those '
        'beside them, at most by 5.05 m and 1.15 deg, after 1700000002.900000000 s | count=1 '
        'after_stamp_s=1700000002.9 time_s=0.1 gone_m=5.05 turned_deg=1.14592 samples=60']
    assert said('outlier', moving('odom base', outlying((20, 40), turned=1.0))) == [
        'warning odom>base | odom -> base has 2 of 60 samples that are far from those beside '
        'them, at most by 5.05 m and 58.4 deg, after 1700000001.900000000 s | count=2 '
        'after_stamp_s=1700000001.9 time_s=0.1 gone_m=5.05 turned_deg=58.4417 samples=60']
    assert said('outlier', moving('odom base', drive())) == []
    assert said('outlier', moving('odom base', poses(60, x=4.0 * (PLACES % 4 == 0)))) == []
    # One in three is no exception.
    assert said('outlier', moving('odom base', outlying(tuple(range(3, 60, 3))))) == []


# --- too_fast

def test_edge_that_is_always_too_fast():
    def fast(speed, count=60, turn_rate=0.0):
        return moving('odom base', poses(count, x=0.1 * speed * np.arange(count),
                                         yaw=0.1 * turn_rate * np.arange(count)), node='/wheels')

    assert said('too_fast', fast(75.0, turn_rate=1.0)) == [
        'warning odom>base | /wheels | odom -> base moves at 75 m/s and 1 rad/s (5 of 100 steps '
        'at more than 75 m/s or 1 rad/s) | p50_speed_m_s=75 p95_speed_m_s=75 '
        'p50_turn_rate_deg_s=57.2958 p95_turn_rate_deg_s=57.2958']
    faster = poses(60, x=0.1 * np.cumsum(80.0 + PLACES), yaw=0.1 * np.cumsum(1.0 + 0.1 * PLACES))
    assert said('too_fast', moving('odom base', faster)) == [
        'warning odom>base | odom -> base moves at 110 m/s and 4 rad/s (5 of 100 steps at more '
        'than 134 m/s or 6.4 rad/s) | p50_speed_m_s=110 p95_speed_m_s=134 '
        'p50_turn_rate_deg_s=229.183 p95_turn_rate_deg_s=366.693']
    assert [short('too_fast', fast(speed)) for speed in (69.99, 70.01)] == [
        [], ['warning odom>base']]
    assert [short('too_fast', fast(100.0, count)) for count in (23, 24)] == [
        [], ['warning odom>base']]


def test_edge_that_always_turns_too_fast_may_be_a_rotor():
    def turning(turn_rate, x=0.0, every_other=1.0, count=60):
        steps = 0.02 * turn_rate * np.where(np.arange(count) % 3, 1.0, every_other)
        at = poses(count, x=x * np.arange(count) / (count - 1), yaw=np.cumsum(steps))
        return moving('base rotor', at, 0.02)

    assert said('too_fast', turning(100.0)) == [
        'note base>rotor | base -> rotor moves at 0 m/s and 100 rad/s (5 of 100 steps at more '
        'than 0 m/s or 100 rad/s) | p50_speed_m_s=0 p95_speed_m_s=0 p50_turn_rate_deg_s=5729.58 '
        'p95_turn_rate_deg_s=5729.58 | cause: a rotor or a wheel that turns by a large part of a '
        'turn from one sample to the next: then these samples do not show how fast it turns; or '
        'degrees sent as radians | fix: nothing to do if it is a rotor. If it is a joint, check '
        'the unit: /joint_states has radians']
    assert [short('too_fast', turning(rate)) for rate in (69.99, 70.01)] == [
        [], ['note base>rotor']]
    assert [short('too_fast', turning(100.0, x)) for x in (0.00099, 0.001)] == [
        ['note base>rotor'], ['warning base>rotor']]
    assert [short('too_fast', turning(100.0, 0.0, part)) for part in (0.59, 0.61)] == [
        ['warning base>rotor'], ['note base>rotor']]
    # A joint in degrees.
    assert said('too_fast', turning(100.0, 0.5, 0.2)) == [
        'warning base>rotor | base -> rotor moves at 0.424 m/s and 100 rad/s (5 of 100 steps at '
        'more than 0.424 m/s or 100 rad/s) | p50_speed_m_s=0.423729 p95_speed_m_s=0.423729 '
        'p50_turn_rate_deg_s=5729.58 p95_turn_rate_deg_s=5729.58']


# --- interpolated_jump

def slowly(gone=1.0, seconds=2.0, still=0.001, place=30, count=60):
    """Return messages of an edge that hardly moves, and once moves far between two samples."""
    stamps = every(0.1, count)
    stamps[place:] += from_seconds(seconds - 0.1)
    at = poses(count, x=still * np.arange(count) + gone * (np.arange(count) >= place),
               yaw=0.001 * np.arange(count))
    return stamps, at


def test_large_step_that_takes_long():
    stamps, at = slowly()
    assert said('interpolated_jump', sent('map odom', stamps, at=at, node='/slam')) == [
        'warning map>odom | /slam | map -> odom jumped once, at most by 1 m and 0.0573 deg in '
        '2.000 s after 1700000002.900000000 s: lookups in between return poses that never '
        'existed | count=1 after_stamp_s=1700000002.9 time_s=2 gone_m=1.001 turned_deg=0.0572958']
    assert short('interpolated_jump', moving('map odom', at)) == [
        'warning map>odom']
    # A wheel turns in place.
    wheel = poses(60, yaw=0.001 * PLACES + 1.0 * (PLACES >= 30))
    assert short('interpolated_jump', sent('map odom', stamps, at=wheel)) == []
    assert [short('interpolated_jump', sent('map odom', stamps, at=poses(
        60, x=0.0 + far * (PLACES == 59), yaw=0.001 * PLACES + 1.0 * (PLACES >= 30))))
        for far in (0.00099, 0.00101)] == [[], ['warning map>odom']]
    rests = poses(60, x=np.where(PLACES < 30, 1.0, 2.0))
    assert short('interpolated_jump', sent('map odom', stamps, at=rests)) == []


def test_large_step_of_a_localiser():
    def corrected(seconds):
        stamps, at = slowly(0.8, seconds)
        return said('interpolated_jump', sent('map odom', stamps, at=at), moving(
            'odom base', drive()), moving('base tool', drive()))

    assert corrected(0.4) == [
        'note map>odom | map -> odom jumped once, at most by 0.801 m and 0.0573 deg in 400 ms '
        'after 1700000002.900000000 s: lookups in between return poses that never existed | '
        'count=1 after_stamp_s=1700000002.9 time_s=0.4 gone_m=0.801 turned_deg=0.0572958 | '
        'cause: a correction of the localiser, which may jump: the edge below it moves smoothly '
        '| fix: plan and control in odom; only goals belong in map']
    assert [one.partition(' | ')[0] for seconds in (0.5 - NANOSECOND, 0.5)
            for one in corrected(seconds)] == [
        'note map>odom',
        'warning map>odom']


# --- moved_once

def stepped(*places, count=60, gone=0.3, turned=0.0, roll=0.0):
    """Return poses that rest, except for steps."""
    done = sum(np.arange(count) >= place for place in places)
    return poses(count, x=gone * done, yaw=turned * done, roll=roll * done)


def test_edge_that_rests_and_moved_once():
    robot = moving('odom base', drive(), node='/wheels')
    assert said('moved_once', robot, moving('base arm', stepped(30), node='/arm')) == [
        'warning base>arm | /arm | base -> arm rests, but moved once, by 0.3 m and 0 deg, after '
        '1700000002.900000000 s | count=1 after_stamp_s=1700000002.9 time_s=0.1 gone_m=0.3 '
        'turned_deg=0']
    assert said('moved_once', robot, moving('base arm', stepped(20, 30, gone=0.02))) == [
        'note base>arm | base -> arm rests, but moved twice, by 0.02 m and 0 deg at most, after '
        '1700000001.900000000 s | count=2 after_stamp_s=1700000001.9 time_s=0.1 gone_m=0.02 '
        'turned_deg=0']
    assert [short('moved_once', robot, moving('base arm', stepped(*places)))
            for places in ((20, 30, 40), (20, 30, 40, 45))] == [['warning base>arm'], []]
    assert [short('moved_once', robot, moving('base arm', stepped(10, count=count)))
            for count in (23, 24)] == [[], ['warning base>arm']]
    assert short('moved_once', robot, moving('base arm', stepped())) == []


def test_what_was_mounted_anew_is_a_warning():
    def found(period=0.1, parent='base', **others):
        return short('moved_once', moving('odom base', drive()), moving(
            f'{parent} arm', stepped(30, **others), period))

    assert [found(gone=gone, turned=0.1) for gone in (0.0, 0.00099, 0.001, 0.00101)] == [
        ['note base>arm'], ['note base>arm'], ['note base>arm'], ['warning base>arm']]
    assert [found(gone=0.01, turned=turned) for turned in (0.0, 0.00099, 0.00101)] == [
        ['note base>arm'], ['note base>arm'], ['warning base>arm']]
    # Without a rotation, if it is too fast or takes too long.
    assert [found(gone=gone) for gone in (0.19, 0.3, 1.2)] == [
        ['note base>arm'], ['warning base>arm'], ['warning base>arm']]
    assert [found(gone=gone, period=0.05) for gone in (0.3, 0.6)] == [
        ['note base>arm'], ['warning base>arm']]
    # Below a map it may be a goal.
    assert [found(parent=parent, turned=0.1) for parent in ('odom', 'base')] == [
        ['note odom>arm'], ['warning base>arm']]


def test_localiser_that_corrects_once_is_not_what_moved_once():
    corrected = poses(60, x=np.where(PLACES < 30, 0.0, 0.1))
    assert short('moved_once', *localised(corrected)) == []


# --- static_republished

def test_edge_that_never_changes():
    still = poses(60, x=0.3)
    robot = moving('odom base', drive(41))
    assert said('static_republished', robot, moving('base lidar', still, node='/urdf')) == [
        'warning base>lidar | /urdf | base -> lidar was sent 60 times in 5.9 s, at 10.0 Hz, and '
        'never changed | count=60 rate_hz=10 span_s=5.9']
    assert said('static_republished', robot, moving('odom goal', still)) == [
        'note odom>goal | odom -> goal was sent 60 times in 5.9 s, at 10.0 Hz, and never changed '
        '| count=60 rate_hz=10 span_s=5.9 | cause: a joint, a robot or a localiser at rest; or a '
        'calibration that is sent like them | fix: nothing to do, if it can move; if not, send '
        'it once on /tf_static']
    assert said('static_republished', moving('base lidar', still)) == []
    lately = still.copy()
    lately[-1, 0] = np.nextafter(0.3, 1.0)
    assert said('static_republished', robot, moving('base lidar', lately)) == []


def test_fixed_edge_came_for_four_seconds_and_twenty_times():
    robot = moving('odom base', drive())

    def found(count, seconds):
        return short('static_republished', robot, moving(
            'base lidar', poses(count, x=0.3), seconds / (count - 1)))

    assert [found(count, 5.7) for count in (19, 20)] == [[], ['warning base>lidar']]
    assert [found(41, seconds) for seconds in (4.0 - 40 * NANOSECOND, 4.0)] == [
        [], ['warning base>lidar']]


def test_what_is_sent_with_a_moving_edge_may_be_a_joint():
    robot = moving('odom base', drive())

    def found(*messages):
        return short('static_republished', robot, *messages)

    still = poses(60, x=0.3)
    assert found(moving('base lidar, arm tool', still)) == [
        'warning base>lidar',
        'note arm>tool']
    assert found(moving('base lidar, lidar tool', still)) == [
        'note base>lidar',
        'note lidar>tool']
    both = [moving('base lidar, arm tool', poses(2, x=0.3)), moving('base lidar', still),
            moving('arm tool', drive())]
    assert found(*both) == [
        'note base>lidar']
    assert found(moving('tool gripper, base lidar', still), moving('arm tool', still)) == [
        'warning base>lidar',
        'note tool>gripper',
        'note arm>tool']


# --- static_changed

def changed(*values, gap=5.0, node='/urdf'):
    """Return a static edge with these translations, metres, each some seconds after another."""
    return sent('base lidar', 0 * every(gap, len(values)), every(gap, len(values)), poses(
        len(values), x=np.array(values), yaw=0.1 * np.array(values)), node, static=True)


def test_static_edge_that_changed():
    assert said('static_changed', changed(0.0, 1.0)) == [
        'warning base>lidar | /urdf | base -> lidar is static and changed once, by up to 1 m and '
        '5.73 deg | changes=1 gone_m=1 turned_deg=5.72958']
    assert said('static_changed', changed(0.0, 1.0, 1.0, 3.0)) == [
        'warning base>lidar | /urdf | base -> lidar is static and changed twice, by up to 2 m '
        'and 11.46 deg | changes=2 gone_m=2 turned_deg=11.4592']
    assert said('static_changed', changed(1.0, 1.0, 1.0)) == []
    assert said('static_changed', changed(0.0, 1.0, 0.0, gap=0.5)) == [
        'warning base>lidar | /urdf | base -> lidar is static and came with different values at '
        'once twice, by up to 1 m and 5.73 deg | changes=2 gone_m=1 turned_deg=5.72958 | cause: '
        'two nodes send it, such as robot_state_publisher and a static_transform_publisher; or '
        'one node keeps an old value for those who join late, and sends it with the new | fix: '
        'send it from one node, with one value: which value counts depends on which message '
        'comes last, and may differ in each process']
    twice = changed(0.0, 1.0), changed(0.0, 2.0, gap=0.5)
    assert said('static_changed', *twice) == [
        'warning base>lidar | /urdf | base -> lidar is static and changed twice, by up to 2 m '
        'and 11.46 deg | changes=2 gone_m=2 turned_deg=11.4592']
    assert said('static_changed', moving('base lidar', drive())) == []


# --- static_late

def test_static_edge_that_arrived_late():
    robot = moving('odom base', drive(), begin=1.0)
    tool = moving('lidar tool', drive(), begin=2.0)
    assert said('static_late', robot, fixed('base lidar', 5.5, '/urdf')) == [
        'note base>lidar | /urdf | base -> lidar is static and arrived 4.500 s after it could '
        'first have been used | late_s=4.5']
    assert [short('static_late', robot, fixed('base lidar', late))
            for late in (4.0, 4.0 + NANOSECOND)] == [[], ['note base>lidar']]
    assert [short('static_late', robot, tool, fixed('base lidar', late))
            for late in (4.0, 4.0 + NANOSECOND)] == [[], ['note base>lidar']]
    assert [short('static_late', tool, fixed('base lidar', late))
            for late in (5.0, 5.0 + NANOSECOND)] == [[], ['note base>lidar']]
    assert said('static_late', robot, fixed('x y', 9.0)) == []
    never = sent('base lidar', np.zeros(1, int), np.array([-1_700_000_000 * 10**9]), static=True)
    assert said('static_late', robot, never) == []


# --- kind_flips

def test_edge_that_is_static_and_moving():
    assert said('kind_flips', moving('base lidar', drive(), node='/driver'),
                fixed('base lidar', 1.0, '/urdf')) == [
        'error base>lidar | /driver, /urdf | base -> lidar came once as static and 60 times as '
        'moving | static=1 moving=60']
    assert said('kind_flips', moving('base lidar', drive(2)), fixed('base lidar', 1.0),
                fixed('base lidar', 2.0)) == [
        'error base>lidar | base -> lidar came twice as static and twice as moving | static=2 '
        'moving=2']
    assert said('kind_flips', moving('odom base', drive()), fixed('base lidar', 1.0)) == []


# --- planar_only

def test_planar_edge_below_one_that_tilts():
    def found(tilt, far=0.6, *others):
        tilting = poses(60, x=0.1, roll=tilt * np.sin(PLACES))
        planar = poses(60, x=far * PLACES / 59, yaw=0.01 * PLACES)
        return said('planar_only', moving('map odom', tilting), *others,
                    moving('odom base', planar, node='/wheels'))

    assert found(0.1) == [
        'note odom>base | /wheels | odom -> base has roll and pitch exactly zero, below an edge '
        'that tilts by 5.7 deg | tilt_deg=5.72952']
    assert [bool(found(tilt)) for tilt in (0.0089, 0.0091)] == [False, True]
    assert [bool(found(0.1, far)) for far in (0.499, 0.5, 0.501)] == [False, False, True]
    assert said('planar_only', moving('map odom', drive()), moving('odom base', drive())) == []
    tilting = poses(60, x=PLACES * 0.1, roll=0.3 * np.sin(PLACES))
    assert said('planar_only', moving('map odom', tilting), moving('odom base', tilting)) == []
    # The largest tilt above counts, through static edges, too.
    slightly = poses(60, x=PLACES * 0.1, roll=0.1 * np.sin(PLACES))
    assert said('planar_only', moving('map odom', tilting), moving('odom mid', slightly),
                fixed('mid base', 0.0), moving('base top', drive(step=0.01)),
                moving('top tip', drive())) == [
        'note base>top | base -> top has roll and pitch exactly zero, below an edge that tilts '
        'by 17.2 deg | tilt_deg=17.1886',
        'note top>tip | top -> tip has roll and pitch exactly zero, below an edge that tilts by '
        '17.2 deg | tilt_deg=17.1886']
    assert said('planar_only', moving('map odom', tilting), moving('map base', drive()),
                doctor=Doctor()) == []
