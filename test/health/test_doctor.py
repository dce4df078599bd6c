# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A doctor of a buffer in memory: normal robots give no finding, and findings are sorted."""

import math

from doctor_findings import only
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.incidents import candidates, one_of
from tf_tree_py.core.messages.observers import Endpoint, ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.sample_rows import Rows
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.measures.timing import Timing

BEGIN = 10**18
SECOND = 10**9


def stream(parent, child, rate_hz, pose, *, delay=0.004, varies=0.001, jitter=0.0, authority='',
           seconds=20):
    """Return messages with one edge; the pose is that of (seconds, random numbers)."""
    rng = np.random.default_rng(0)
    messages = []
    for t in np.arange(0.0, seconds, 1.0 / rate_hz):
        t += jitter * rng.normal()
        stamp = BEGIN + round(t * SECOND)
        messages.append(ReceivedMessage(
            Batch([(parent, child)], [stamp], [pack_pose(*pose(t, rng))]),
            stamp + round((delay + varies * rng.random()) * SECOND), '/tf', False, authority))
    return messages


def findings_of(*streams, doctor=None):
    doctor = doctor or Doctor()
    buffer = BufferCore(doctor.limits.cache_time)
    buffer.observers.add(doctor)
    for message in sorted(sum(streams, []), key=lambda message: message.received):
        buffer.observers.notify_received(message)
        buffer.insert_batch(message.batch, message.authority, message.static, announced=True)
    return doctor.findings()


def drive(t, rng):
    return Pose.from_xyz_rpy(x=0.5 * t, yaw=0.3 * math.sin(t))


def noise(size):
    return lambda t, rng: Pose.from_xyz_rpy(*(size * rng.normal(size=6)))


WHEELS = stream('odom', 'base', 50, drive)

CALM = {
    'noise at rest': [stream('odom', 'base', 50, noise(0.01))],
    'an encoder whose last digit flickers': [stream(
        'base', 'joint', 50, lambda t, rng: Pose.from_xyz_rpy(yaw=0.01 * (rng.random() > 0.5)))],
    'a vibration near half the rate': [stream(
        'odom', 'base', 50, lambda t, rng: Pose.from_xyz_rpy(
            x=0.1 * t, roll=0.02 * math.sin(150.0 * t)))],
    'a circular vibration at 0.4 of the rate': [stream(
        'odom', 'base', 50, lambda t, rng: Pose(
            0.03 * math.sin(40.0 * math.pi * t), 0.03 * math.cos(40.0 * math.pi * t)))],
    'a timer that trembles': [stream('odom', 'base', 50, drive, jitter=0.003)],
    'a car': [stream('map', 'base', 20, lambda t, rng: Pose(30.0 * t))],
    'a wheel': [WHEELS, stream('base', 'wheel', 50, lambda t, rng: Pose.from_xyz_rpy(
        pitch=20.0 * t))],
    'a slow localiser with small corrections': [WHEELS, stream(
        'map', 'odom', 2, lambda t, rng: Pose(0.03 * round(t / 3.0)))],
    'a localiser that has nothing to correct': [WHEELS, stream(
        'map', 'odom', 10, lambda t, rng: Pose(1.0))],
    'a wheel that turns by nearly half a turn a sample, from the fifth second on': [
        WHEELS, stream('base', 'wheel', 10, lambda t, rng: Pose.from_xyz_rpy(
            pitch=30.0 * max(0.0, t - 5.0)))],
    'a wheel that turns once and stops, between two samples': [WHEELS, stream(
        'base', 'wheel', 10, lambda t, rng: Pose.from_xyz_rpy(pitch=2.5 * (t > 5.0)))],
    'a servo that steps': [WHEELS, stream('base', 'arm', 50, lambda t, rng: Pose.from_xyz_rpy(
        yaw=0.2 * (t > 5.0)))],
    'a robot that stands': [stream('odom', 'base', 50, lambda t, rng: Pose(1.0)),
                            stream('base', 'arm', 50, lambda t, rng: Pose(2.0))],
}


@pytest.mark.parametrize('name', CALM)
def test_calm_robot_is_left_alone(name):
    assert [finding for finding in findings_of(*CALM[name])
            if finding.severity is not Severity.NOTE] == []


def tags(leaves, returns=math.inf):
    """Return messages of a detector with three tags, of which one leaves the view."""
    rng = np.random.default_rng(0)
    edges = [('camera', f'tag_{number}') for number in range(3)]
    fewer = edges[:2]
    messages = []
    for t in np.arange(0.0, 20.0, 0.1):
        seen = fewer if leaves < t < returns else edges
        poses = [pack_pose(*Pose.from_xyz_rpy(x=1.0 + 0.2 * math.sin(t) + 0.002 * rng.normal(),
                                              yaw=0.1 * math.cos(t))) for _ in seen]
        stamp = BEGIN + round(t * SECOND)
        messages.append(ReceivedMessage(
            Batch(seen, [stamp] * len(seen), poses), stamp + SECOND // 20, '/tf', False))
    return messages


CAMERA = stream('base', 'camera', 50, lambda t, rng: Pose(0.1 * math.sin(t)))


@pytest.mark.parametrize('returns, code', [(14.0, 'gap'), (math.inf, 'stale')])
def test_tag_that_leaves_the_view_is_a_note(returns, code):
    found = only(findings_of(WHEELS, CAMERA, tags(8.0, returns)))
    assert (found.code, found.severity) == (code, Severity.NOTE)
    assert found.frames == ('camera', 'tag_2')
    assert 'out of view' in found.cause


def test_detector_that_dies_is_an_error():
    found = findings_of(WHEELS, CAMERA, [
        message for message in tags(8.0) if message.received < BEGIN + 10 * SECOND])
    assert {one.frames[1]: one.severity for one in found} == {
        'tag_0': Severity.ERROR, 'tag_1': Severity.ERROR, 'tag_2': Severity.NOTE}


def test_joint_that_is_missing_among_others_is_an_error():
    """It rotates in place, unlike a tag."""
    missing = [message._replace(batch=Batch(
        message.batch.edges, message.batch.stamps,
        [pack_pose(*Pose.from_xyz_rpy(yaw=math.sin(number)))
         for _ in message.batch.edges])) for number, message in enumerate(tags(8.0))]
    found = only(findings_of(WHEELS, CAMERA, missing))
    assert (found.code, found.severity) == ('stale', Severity.ERROR)


@pytest.mark.parametrize('first_hz, second_hz', [(100, 50), (100, 20), (50, 20)])
def test_two_publishers_of_different_rates_are_found(first_hz, second_hz):
    first = stream('odom', 'base', first_hz, drive)
    second = shifted(stream('odom', 'base', second_hz, lambda t, rng: drive(t, rng) @ Pose(
        y=0.2)), 0.004)
    found = only(findings_of(first, [message._replace(received=message.received + SECOND // 250)
                                     for message in second]))
    assert found.code == 'two_publishers'


def test_wheel_that_dies_beside_another_is_an_error_though_its_place_flickers():
    """A product of poses differs in the last bit."""
    wheels = [('base', 'left'), ('base', 'right')]
    messages = []
    for number, message in enumerate(WHEELS):
        edges = wheels if number < 500 else wheels[:1]
        messages.append(message._replace(batch=Batch(
            edges, message.batch.stamps * len(edges),
            [pack_pose(*Pose.from_xyz_rpy(x=0.3 + 1e-9 * (number % 2), pitch=0.1 * number))
             for _ in edges])))
    found = only(findings_of(WHEELS, messages))
    assert (found.code, found.severity) == ('stale', Severity.ERROR)


def test_old_stamps_are_not_ahead_of_the_clock():
    mixed = stream('map', 'odom', 20, drive)
    for number in range(100, 300, 20):
        for place in (number, number + 2):
            mixed[place] = shifted(mixed[place:place + 1], -15.0)[0]
    assert 'future_stamps' not in {one.code for one in findings_of(WHEELS, mixed)}


def test_node_that_sends_its_last_data_by_a_timer_of_its_own_has_no_slow_clock():
    resent = []
    for place, message in enumerate(stream('map', 'odom', 2, drive)):
        late = 0.01 * place  # of up to an interval
        resent.append(message._replace(received=message.received + round(late * SECOND)))
    assert findings_of(WHEELS, resent) == []


def test_recording_in_a_loop_with_repeated_stamps_is_not_frozen():
    """The two samples of one stamp are in two blocks, and the second pass is in the second."""
    timing = Timing()
    stamps = BEGIN + np.repeat(np.arange(300), 2) * SECOND // 10
    received = BEGIN + np.arange(1200) * SECOND // 20
    for block in (slice(0, 599), slice(599, 1200)):
        stamps_of = np.concatenate([stamps, stamps])[block]
        timing.add(Rows(received[block], stamps_of, np.zeros((7, len(stamps_of)))))
    assert timing.frozen.samples == 2


def test_static_edge_that_is_refused_as_a_loop_has_no_second_parent():
    buffer, doctor = BufferCore(), Doctor()
    buffer.observers.add(doctor)
    for parent, child in [('a', 'b'), ('b', 'c'), ('c', 'b')]:
        arrival = ReceivedMessage(Batch([(parent, child)], [0], [pack_pose(*Pose())]), BEGIN,
                                  '/tf_static', True)
        buffer.observers.notify_received(arrival)
        buffer.insert_batch(arrival.batch, '', True, announced=True)
    found = only(doctor.findings())
    assert (found.code, found.edges) == ('loop', (('c', 'b'),))


def test_frozen_stamp_that_resumes_is_no_gap():
    frozen = [shifted([message], -0.02 * max(0, min(number, 700) - 400))[0]
              if 400 < number <= 700 else message for number, message in enumerate(WHEELS)]
    found = only(findings_of(frozen))
    assert (found.code, found.severity) == ('frozen_stamp', Severity.WARNING)


def test_localiser_of_a_standing_robot_that_dies_is_an_error():
    still = stream('map', 'odom', 10, lambda t, rng: Pose(1.0))[:80]
    standing = stream('odom', 'base', 50, lambda t, rng: Pose(0.001 * rng.random()))
    found = findings_of(standing, still)
    assert [(one.code, one.severity) for one in found] == [
        ('stale', Severity.ERROR), ('static_republished', Severity.NOTE)]


def test_what_cannot_answer_for_the_present_is_left_behind():
    def sensor(name, seconds=20):
        return stream('base', name, 50, noise(0.01), seconds=seconds)

    def frozen(messages, begin, end):
        return [message._replace(batch=message.batch._replace(stamps=messages[begin].batch.stamps))
                if begin < number < end else message for number, message in enumerate(messages)]

    doctor = Doctor()
    findings_of(WHEELS, sensor('good'), sensor('gone', seconds=10),
                frozen(sensor('frozen'), 600, 1000), frozen(sensor('thawed'), 300, 400),
                shifted(sensor('elsewhere'), -3600.0), doctor=doctor)
    assert {child for _, child in doctor.left_behind()} == {'gone', 'frozen', 'elsewhere'}


def test_nothing_is_left_behind_where_no_clock_shows_when_it_arrived():
    buffer, doctor = BufferCore(), Doctor()
    buffer.observers.add(doctor)
    for number in range(20):
        buffer.insert('map', 'base', BEGIN + number * SECOND, Pose(x=number))
    assert not doctor.left_behind()


def test_stamp_that_is_frozen_from_the_first_message_is_an_error():
    late = [message._replace(batch=message.batch._replace(stamps=[BEGIN - 100 * SECOND]))
            for message in stream('map', 'odom', 10, lambda t, rng: Pose(1.0))]
    found = only(findings_of(WHEELS, late))
    assert (found.code, found.severity) == ('frozen_stamp', Severity.ERROR)
    assert 'and with no other' in found.summary


def shifted(messages, seconds):
    """Return messages with other stamps."""
    return [message._replace(batch=message.batch._replace(
        stamps=[stamp + round(seconds * SECOND) for stamp in message.batch.stamps]))
        for message in messages]


@pytest.mark.parametrize('seconds, code, severity', [
    (-0.3, 'clock_offset', Severity.WARNING), (-2.0, 'clock_offset', Severity.WARNING),
    (0.3, 'post_dated', Severity.NOTE), (1.0, 'post_dated', Severity.NOTE),
    (3.0, 'future_stamps', Severity.WARNING)])
def test_clock_of_one_of_two_edges_is_wrong(seconds, code, severity):
    """The delays of both vary by 30 ms, as in recordings of real robots."""
    noisy = [stream(*edge, 20, drive, varies=0.03) for edge in [('map', 'odom'), ('odom', 'base')]]
    for place in (0, 1):
        edges = [*noisy]
        edges[place] = shifted(noisy[place], seconds)
        found = only(findings_of(*edges))
        assert (found.code, found.severity) == (code, severity)
        assert found.edges == (('map', 'odom'), ('odom', 'base'))[place:place + 1]


@pytest.mark.parametrize('part', [-0.02, 0.02])
def test_clock_that_is_slow_or_fast_is_found(part):
    noisy = stream('map', 'odom', 20, drive, varies=0.03)
    drifting = [message._replace(batch=message.batch._replace(
        stamps=[stamp + round(part * (stamp - BEGIN)) for stamp in message.batch.stamps]))
        for message in noisy]
    found = only(findings_of(WHEELS, drifting))
    assert (found.code, found.edges) == ('clock_drift', (('map', 'odom'),))
    assert -2.2 < 100.0 * part * found.evidence['drift_percent'] / abs(100.0 * part) < -1.8


def test_messages_that_a_link_held_back_are_no_step_of_a_clock():
    """Some of them were lost, so the stamps jump while all arrive at once."""
    held = [[message._replace(received=max(message.received, BEGIN + 5 * SECOND + number * 1000))
             for number, message in enumerate(messages)
             if not 2 * SECOND < message.received - BEGIN < 3.2 * SECOND]
            for messages in (stream('map', 'odom', 20, drive), WHEELS)]
    assert 'clock_step' not in {one.code for one in findings_of(*held)}


def test_finding_of_one_edge_hides_nothing_of_another():
    behind = shifted(stream('base', 'arm', 50, drive), -0.3)
    late = stream('arm', 'tool', 10, drive, delay=0.7, varies=0.09, seconds=19.3)
    assert {(one.code, one.edges) for one in findings_of(WHEELS, behind, late)} == {
        ('clock_offset', (('base', 'arm'),)), ('delayed', (('arm', 'tool'),))}


def test_simulated_clock_of_a_recorder_is_not_blamed_on_chrony():
    """It ticks at 5 Hz, so the stamps of all edges are ahead of it."""
    ticks = [message._replace(received=(message.received - BEGIN) // 200_000_000 * 200_000_000
                              + SECOND)
             for message in WHEELS + stream('map', 'odom', 50, drive)]
    found = only(findings_of(shifted(ticks, 1 - BEGIN / SECOND)))
    assert (found.code, found.severity) == ('future_stamps', Severity.NOTE)
    assert 'chrony' not in found.cause + found.fix


def test_largest_jump_of_a_localiser_is_reported_once():
    poses = np.cumsum([0.0] * 50 + [0.5] + [0.0] * 50 + [2.7] + [0.0] * 50)
    found = findings_of(WHEELS, stream('map', 'odom', 8, lambda t, rng: Pose(
        poses[min(round(8 * t), 150)])))
    jump = only(one for one in found if 'jump' in one.code)
    assert (jump.code, jump.severity) == ('pose_jump', Severity.NOTE)
    assert jump.evidence['gone_m'] == pytest.approx(2.7)


@pytest.mark.parametrize('rate_hz', [10, 20, 50, 200])
@pytest.mark.parametrize('speed', [0.5, 2.0])
def test_two_publishers_4_ms_and_0_2_m_apart_are_found_in_motion(rate_hz, speed):
    first = stream('odom', 'base', rate_hz, lambda t, rng: Pose(speed * t))
    second = stream('odom', 'base', rate_hz, lambda t, rng: Pose(speed * t, 0.12, 0.16))
    found = only(findings_of(first, [message._replace(received=message.received + SECOND // 250)
                                     for message in shifted(second, 0.004)]))
    assert found.code == 'two_publishers'
    assert found.evidence['apart_m'] == pytest.approx(0.2, rel=0.1)


def test_worst_comes_first_with_numbers_cause_and_fix():
    late = stream('base', 'arm', 10, drive, delay=0.7, varies=0.09, seconds=19.3)
    own = [ReceivedMessage(Batch([('arm', 'arm')], [BEGIN], [pack_pose(*Pose())]), BEGIN, '/tf',
                           False, 'one of /a, /b')]
    worst, other = findings_of(WHEELS, late, own)
    assert (worst.code, worst.severity) == ('self_edge', Severity.ERROR)
    assert worst.publishers == ('/a', '/b')
    assert worst.evidence == {'count': 1}
    assert (worst.cause, worst.fix) == (CODES['self_edge'].cause, CODES['self_edge'].fix)
    assert (other.code, other.frames) == ('delayed', ('base', 'arm'))
    assert 0.7 < other.evidence['p50_delay_s'] < 0.79


def test_limits_say_what_is_right():
    late = stream('base', 'arm', 10, drive, delay=0.7, varies=0.09)
    assert findings_of(late, doctor=Doctor(Thresholds(max_delay=SECOND))) == []


def test_correction_of_a_localiser_is_named_as_that():
    found = only(findings_of(WHEELS, stream(
        'map', 'odom', 50, lambda t, rng: Pose(2.0 * (t > 5.0)))))
    assert (found.code, found.severity) == ('pose_jump', Severity.NOTE)
    assert 'localiser' in found.cause


def test_one_stamp_of_the_far_future_is_an_error():
    poisoned = stream('odom', 'base', 50, drive)
    batch = poisoned[300].batch
    poisoned[300] = poisoned[300]._replace(batch=batch._replace(
        stamps=[batch.stamps[0] + 3600 * SECOND]))
    found = only(findings_of(poisoned))
    assert (found.code, found.severity) == ('future_stamps', Severity.ERROR)
    assert 3599.0 < found.evidence['furthest_s'] < 3600.0


def test_who_is_not_heard_is_known_from_the_graph():
    doctor = Doctor()
    doctor.endpoints = [
        Endpoint('/tf', False, '/quiet', True, False, False),
        Endpoint('/tf', False, '/ear', False, True, False),
        Endpoint('/tf', False, '/other', False, False, False)]
    found = only(doctor.findings())
    assert (found.code, found.publishers) == ('qos_mismatch', ('/quiet', '/ear'))


@pytest.mark.parametrize(('authority', 'frames'), [
    ('/driver', ('base', 'lidar')), ('one of /driver, /robot', ()), ('/robot', ())])
def test_edge_that_may_be_of_another_node_is_not_blamed_on_a_volatile_publisher(
        authority, frames):
    buffer, doctor = BufferCore(), Doctor()
    buffer.observers.add(doctor)
    doctor.endpoints = [Endpoint('/tf_static', True, '/driver', True, True, False),
                        Endpoint('/tf_static', True, '/robot', True, True, True)]
    buffer.insert('base', 'lidar', 1, Pose(), static=True, authority=authority)
    found = only(doctor.findings())
    assert (found.code, found.publishers, found.frames) == ('late_joiner', ('/driver',), frames)


def test_doctor_judges_refusals_of_samples_inserted_by_hand():
    buffer, doctor = BufferCore(), Doctor()
    buffer.observers.add(doctor)
    buffer.insert('a', 'b', 1, Pose(), static=True)
    buffer.insert('b', 'a', 1, Pose(), static=True, authority='/culprit', strict=False)
    found = only(doctor.findings())
    assert (found.code, found.publishers) == ('loop', ('/culprit',))
    assert found.frames == ('b', 'a')


def test_first_of_several_loops_is_the_one_that_was_refused_most_often():
    """The correct edge is also refused, where the wrong one once came first."""
    buffer, doctor = BufferCore(), Doctor()
    buffer.observers.add(doctor)
    buffer.insert('tool', 'base', 1, Pose(), authority='/arm_calibration')
    buffer.insert('base', 'tool', 2, Pose(), authority='/arm', strict=False)
    buffer.clear()
    buffer.insert('base', 'tool', 3, Pose(), authority='/arm')
    for stamp in range(4, 504):
        buffer.insert('tool', 'base', stamp, Pose(), authority='/arm_calibration', strict=False)
    loops = [found for found in doctor.findings() if found.code == 'loop']
    assert [(found.frames, found.evidence['count'], found.publishers) for found in loops] == [
        (('tool', 'base'), 500, ('/arm_calibration',)), (('base', 'tool'), 1, ('/arm',))]


@pytest.mark.parametrize('numbers', [1e308, -1e308, 1e-320, math.nan, math.inf])
def test_numbers_at_the_end_of_what_there_is_do_no_harm(numbers):
    wild = stream('odom', 'base', 50, lambda t, rng: tuple(
        numbers if rng.random() < 0.5 else 1.0 for _ in range(7)))
    for found in findings_of(WHEELS, wild):
        assert is_finite(found)


def is_finite(finding):
    values = finding.as_dict()['evidence'].values()
    return all(value is None or math.isfinite(value) for value in values)


def test_stamps_at_the_ends_of_time_do_no_harm():
    batches = [Batch([('a', 'b')], [stamp], [pack_pose(*Pose())])
               for stamp in (-2**63, 2**63 - 1, 0, -1) * 5]
    found = findings_of([ReceivedMessage(batch, BEGIN + number, '/tf') for number,
                         batch in enumerate(batches)])
    assert {one.code for one in found} == {
        'zero_stamps', 'jump_back', 'out_of_order', 'future_stamps'}
    assert all(map(is_finite, found))


def test_a_thousand_trees_are_told_a_hundred_times():
    islands = [ReceivedMessage(Batch([(f'a{number}', f'b{number}')], [BEGIN],
                                     [pack_pose(*Pose())]),
                               BEGIN + number, '/tf') for number in range(1000)]
    assert len(findings_of(islands)) == 100


def test_empty_messages_and_an_edge_twice_in_one_message():
    edges = [('a', 'b'), ('a', 'b')]
    messages = [ReceivedMessage(Batch(edges, [BEGIN + 1, BEGIN + 1], [pack_pose(*Pose())] * 2),
                                BEGIN,
                                '/tf'), ReceivedMessage(Batch((), (), ()), BEGIN, '/tf')] * 10
    assert {found.code for found in findings_of(messages)} <= {'duplicate_stamps'}


@pytest.mark.parametrize('count', [1, 2, 40])
def test_all_who_may_be_meant_are_told(count):
    names = [f'/node{number:02}' for number in range(count)]
    assert candidates(one_of(names)) == names[:12]
