# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Several sources of one edge: the active source, and the switch to another."""

from contextlib import suppress
import pickle
import random
import threading

from crew import Crew, PATIENCE_S
from inputs import for_each
import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, load
from tf_tree_py.core import InvalidArgumentException, Kind, Pose, se3, UNLIMITED
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.reports.switch_status import as_values, SwitchReports

SECOND = 1_000_000_000
MS = 1_000_000
STEP = 10 * MS
LIMITS = {'over': 0, 'max_speed': 0.3, 'max_turn_rate': 0.5}
ELSEWHERE = Pose.from_xyz_rpy(x=0.3, y=-0.4, yaw=0.2)


def wheels(stamp):
    t = stamp / SECOND
    return Pose.from_xyz_rpy(x=0.2 * np.sin(t), y=0.2 - 0.2 * np.cos(t), yaw=t)


def visual(stamp):
    """Return the same motion from a source with another origin."""
    return ELSEWHERE @ wheels(stamp)


def slipping(stamp):
    """Return a motion that is twice as fast from 2 s on."""
    return wheels(stamp) @ Pose(x=max(stamp - 2 * SECOND, 0) / SECOND)


SAYS = {'wheels': wheels, 'visual': visual, 'slipping': slipping, 'third': visual}


def feed(buffer, since, until, *names):
    """Insert the samples of sources in a time span; return the reported incidents."""
    return [incident for stamp in range(since + STEP, until + 1, STEP) for name in names
            for incident in buffer.insert_from(name, 'odom', 'base', stamp, SAYS[name](stamp))]


def fed(until, *names):
    buffer = BufferCore(UNLIMITED)
    feed(buffer, -STEP, until, *names)
    return buffer


def answers(buffer, stamps):
    return [buffer.lookup_at('odom', 'base', stamp) for stamp in stamps]


def active(buffer):
    return [source.name for source in buffer.sources_of('base') if source.is_active]


def assert_never_jumps(buffer, until):
    """Assert that the edge has its own motion (0.2 m/s, 1 rad/s) within the limits."""
    poses = buffer.lookup_many('odom', 'base', np.arange(0, until + 1, STEP))
    gone, turned = se3.distance_many(poses[:-1], poses[1:])
    assert gone.max() <= (0.2 + LIMITS['max_speed']) * STEP / SECOND + 1e-9
    assert turned.max() <= (1.0 + LIMITS['max_turn_rate']) * STEP / SECOND + 1e-9


def test_the_first_that_is_heard_answers_and_all_are_kept():
    buffer = fed(SECOND, 'wheels', 'visual')
    assert buffer.lookup('odom', 'base', SECOND // 2) == wheels(SECOND // 2)
    assert [(source.name, source.newest, source.is_active)
            for source in buffer.sources_of('base')] == [
        ('wheels', SECOND, True), ('visual', SECOND, False)]
    assert buffer.edges()[0].authority == 'wheels'


def test_switch_begins_where_the_edge_is_and_ends_with_the_other_source():
    buffer = fed(SECOND, 'wheels', 'visual')
    stamps = range(0, SECOND + 1, 3 * MS)
    before = answers(buffer, stamps)
    change = buffer.switch('base', to='visual', **LIMITS)
    assert change.begin == SECOND < change.end < 7 * SECOND and active(buffer) == ['visual']
    feed(buffer, SECOND, 7 * SECOND, 'wheels', 'visual')
    assert answers(buffer, stamps) == before
    assert_never_jumps(buffer, 7 * SECOND)
    assert_same_pose(buffer.lookup('odom', 'base', 7 * SECOND), visual(7 * SECOND))
    assert buffer.edges()[0].authority == 'visual'


def test_back_and_forth_during_a_blend_never_jumps():
    buffer = fed(SECOND, 'wheels', 'visual')
    now = SECOND
    for number in range(12):
        buffer.switch('base', to=('visual', 'wheels')[number % 2], **LIMITS)
        feed(buffer, now, now + 170 * MS, 'wheels', 'visual')
        now += 170 * MS
    assert_never_jumps(buffer, now)


def test_one_that_lags_goes_on_when_it_has_reached_the_edge():
    buffer = fed(SECOND, 'wheels')
    feed(buffer, -STEP, SECOND - 300 * MS, 'visual')
    assert buffer.switch('base', to='visual', **LIMITS) is None
    feed(buffer, SECOND, SECOND + 200 * MS, 'wheels')
    feed(buffer, SECOND - 300 * MS, SECOND - STEP, 'visual')
    assert buffer.latest_common_time('odom', 'base') == SECOND
    feed(buffer, SECOND - STEP, 7 * SECOND, 'visual')
    assert_never_jumps(buffer, 7 * SECOND)
    assert_same_pose(buffer.lookup('odom', 'base', 7 * SECOND), visual(7 * SECOND))


def test_one_that_is_ahead_goes_on_at_once():
    buffer = fed(SECOND, 'wheels')
    feed(buffer, -STEP, 2 * SECOND, 'visual')
    buffer.switch('base', to='visual', **LIMITS)
    assert buffer.latest_common_time('odom', 'base') == 2 * SECOND
    assert_never_jumps(buffer, 2 * SECOND)


def test_late_sample_of_the_new_source_changes_nothing_before_the_switch():
    buffer = fed(SECOND, 'wheels', 'visual')
    before = buffer.lookup('odom', 'base', 503 * MS)
    buffer.switch('base', to='visual', **LIMITS)
    buffer.insert_from('visual', 'odom', 'base', 503 * MS, visual(503 * MS))
    assert buffer.lookup('odom', 'base', 503 * MS) == before


def test_one_that_falls_silent_makes_way_and_that_is_told():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    heard = []

    class Ear(Observer):

        def saw_incidents(self, incidents):
            heard.extend(incidents)

    buffer.observers.add(Ear())
    told = feed(buffer, SECOND, 7 * SECOND, 'visual')
    assert [incident.kind for incident in told] == [Kind.SOURCE_SILENT] and told == heard
    assert "'wheels' sent nothing for more than 100 ms" in told[0].detail
    assert not told[0].refused and buffer.statistics().incidents[Kind.SOURCE_SILENT] == 1
    assert active(buffer) == ['visual']
    assert_never_jumps(buffer, 7 * SECOND)
    assert_same_pose(buffer.lookup('odom', 'base', 7 * SECOND), visual(7 * SECOND))


def test_one_that_made_way_is_known_until_it_answers_again():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    told, = feed(buffer, SECOND, 2 * SECOND, 'visual')
    assert [source.made_way for source in buffer.sources_of('base')] == [told, None]
    # Another process gets the report as text, however often it occurs, and receives it once.
    words, elsewhere = as_values(buffer.sources_of('base')), SwitchReports()
    heard = [*elsewhere.news('robot: tf odom -> base', words),
             *elsewhere.news('robot: tf odom -> base', words)]
    assert heard == [told]
    feed(buffer, 2 * SECOND, 3 * SECOND, 'wheels', 'visual')
    buffer.switch('base', to='wheels')
    assert [source.made_way for source in buffer.sources_of('base')] == [None, None]
    assert as_values(buffer.sources_of('base')) == {}


@for_each(status=['robot: tf', 'odom -> base', 'robot: tf odom -> base'],
          values=[{}, {'Made way: wheels': 'because'}, {'Rate (Hz)': '3'}])
def test_what_says_nothing_of_sources_is_no_news(status, values):
    assert SwitchReports().news(status, values) == []


def test_one_that_is_awaited_and_dies_makes_way_too():
    """Otherwise the edge would stop, although another source continues."""
    buffer = fed(SECOND, 'wheels')
    feed(buffer, -STEP, SECOND - 50 * MS, 'visual')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    assert buffer.switch('base', to='visual', **LIMITS) is None
    told = feed(buffer, SECOND, 3 * SECOND, 'wheels')
    assert [(incident.kind, incident.authority) for incident in told] == [
        (Kind.SOURCE_SILENT, 'visual')]
    assert active(buffer) == ['wheels']
    assert buffer.latest_common_time('odom', 'base') == 3 * SECOND
    assert_never_jumps(buffer, 3 * SECOND)


def test_of_three_that_fall_silent_one_after_the_other_the_last_answers():
    buffer = fed(SECOND, 'wheels', 'visual', 'third')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    told = feed(buffer, SECOND, 2 * SECOND, 'visual', 'third')
    told += feed(buffer, 2 * SECOND, 3 * SECOND, 'third')
    assert [incident.authority for incident in told] == ['wheels', 'visual']
    assert active(buffer) == ['third']
    assert_never_jumps(buffer, 3 * SECOND)


def test_stamps_around_zero_are_judged_like_others():
    def turned_back(stamp):
        return SAYS['slipping'](stamp + 2 * SECOND)

    buffer, told = BufferCore(UNLIMITED), []
    for stamp in range(-2 * SECOND, 2 * SECOND, STEP):
        for name, pose in (('slipping', turned_back), ('visual', visual), ('third', visual)):
            told += buffer.insert_from(name, 'odom', 'base', stamp, pose(stamp))
        if stamp == -2 * SECOND:
            buffer.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), **LIMITS)
    assert [incident.kind for incident in told] == [Kind.SOURCE_DIVERGED]


def test_old_sample_of_any_source_is_refused_and_told():
    buffer = BufferCore(SECOND)
    feed(buffer, -STEP, 3 * SECOND, 'wheels', 'visual')
    for name in ('wheels', 'visual'):
        told, = buffer.insert_from(name, 'odom', 'base', SECOND, Pose())
        assert (told.kind, told.authority) == (Kind.OLD_DATA, name)
    assert buffer.statistics().incidents[Kind.OLD_DATA] == 2


def test_switch_that_cannot_be_changes_nothing():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    buffer.insert('odom', 'base', 0, Pose(x=5.0), static=True, strict=False)
    with pytest.raises(InvalidArgumentException, match='is static'):
        buffer.switch('base', to='visual')
    assert active(buffer) == ['wheels']
    # The rule does nothing either if the edge is not that of the sources.
    assert not feed(buffer, SECOND, 2 * SECOND, 'visual')
    assert active(buffer) == ['wheels'] and buffer.lookup('odom', 'base') == Pose(x=5.0)
    buffer.remove_frame('base')
    with pytest.raises(InvalidArgumentException, match='has no sources'):
        buffer.switch('base', to='visual')


def test_saved_and_still_switch_is_answered_as_it_was(tmp_path):
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch('base', to='visual', over=3 * SECOND)
    feed(buffer, SECOND, 2 * SECOND, 'wheels', 'visual')
    buffer.save(tmp_path / 'tree')
    still, stamps = buffer.snapshot(), range(0, 2 * SECOND, 3 * MS)
    before = answers(buffer, stamps)
    buffer.switch('base', to='wheels', over=SECOND)
    feed(buffer, 2 * SECOND, 3 * SECOND, 'wheels', 'visual')
    for tree in (buffer, still, load(tmp_path / 'tree')):
        assert answers(tree, stamps) == before


def test_storm_of_sources_switches_and_readers():
    buffer, answered = fed(0, 'wheels', 'visual'), {}
    until, asked = 3 * SECOND, random.Random(3)
    gone_on = threading.Barrier(3)

    def say(name):
        for stamp in range(0, until, 50 * MS):
            feed(buffer, stamp, stamp + 50 * MS, name)
            gone_on.wait(PATIENCE_S)

    def switch():
        for number in range(until // (50 * MS)):
            with suppress(InvalidArgumentException):  # it is already active, when the other lags
                buffer.switch('base', to=('visual', 'wheels')[number % 2], **LIMITS)
            gone_on.wait(PATIENCE_S)

    def read():
        newest = buffer.latest_common_time('odom', 'base')
        for stamp in (newest, asked.randrange(newest + 1)):
            pose = buffer.lookup_at('odom', 'base', stamp)
            assert answered.setdefault(stamp, pose) == pose

    crew = Crew()
    for name in ('wheels', 'visual'):
        crew.write(say, name)
    crew.write(switch)
    crew.read(read)
    crew.read(read)
    crew.run()
    assert buffer.corrections_version > 20 and len(answered) > 100
    for stamp, pose in answered.items():
        assert buffer.lookup_at('odom', 'base', stamp) == pose
    assert_never_jumps(buffer, buffer.latest_common_time('odom', 'base'))


def test_one_that_diverges_from_two_others_makes_way():
    buffer = fed(SECOND, 'slipping', 'visual', 'third')
    buffer.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), **LIMITS)
    told = feed(buffer, SECOND, 4 * SECOND, 'slipping', 'visual', 'third')
    assert [incident.kind for incident in told] == [Kind.SOURCE_DIVERGED]
    assert 2 * SECOND < told[0].stamp <= 2200 * MS
    assert active(buffer) == ['visual']


def test_of_two_that_differ_the_one_heard_first_is_believed():
    buffer = fed(SECOND, 'wheels', 'slipping')
    buffer.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), **LIMITS)
    assert not feed(buffer, SECOND, 4 * SECOND, 'wheels', 'slipping')
    assert active(buffer) == ['wheels']
    buffer = fed(SECOND, 'wheels', 'slipping')
    buffer.switch('base', to='slipping', over=0)
    buffer.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), **LIMITS)
    told = feed(buffer, SECOND, 4 * SECOND, 'wheels', 'slipping')
    assert [incident.kind for incident in told] == [Kind.SOURCE_DIVERGED]
    assert active(buffer) == ['wheels']


def test_smoothed_is_what_the_active_source_says_from_its_beginning():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch('base', to='visual', **LIMITS)
    feed(buffer, SECOND, SECOND + 500 * MS, 'wheels', 'visual')
    whole = buffer.smoothed()
    for stamp in (0, SECOND // 2, SECOND + 500 * MS):
        assert_same_pose(whole.lookup_at('odom', 'base', stamp), visual(stamp))


def test_after_clear_the_first_that_is_heard_answers():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.clear()
    feed(buffer, -STEP, SECOND, 'visual', 'wheels')
    assert active(buffer) == ['visual']
    assert buffer.lookup('odom', 'base', SECOND) == visual(SECOND)


def test_what_cannot_be_done_says_why():
    buffer = fed(SECOND, 'wheels')
    feed(buffer, SECOND, 2 * SECOND, 'visual')  # it began after the edge's newest sample
    for to, why in (('visual', 'began after'), ('wheels', 'already'), ('visul', 'no source')):
        with pytest.raises(InvalidArgumentException, match=why):
            buffer.switch('base', to=to)
    with pytest.raises(InvalidArgumentException, match='has no sources'):
        buffer.switch('camera', to='wheels')
    with pytest.raises(InvalidArgumentException, match='same parent'):
        buffer.insert_from('laser', 'map', 'base', SECOND, Pose())
    for wrong in ({'max_age': 0}, {'max_age': 0.1}, {'max_age': 1, 'gate': 3},
                  {'max_age': 1, 'gate': (-1, 0)}, {'max_age': 1, 'window': None}):
        with pytest.raises(InvalidArgumentException):
            buffer.switch_by_rule('base', **wrong)
    with pytest.raises(InvalidArgumentException, match='keeps 500 ms'):
        short = BufferCore(500 * MS)
        feed(short, 0, SECOND, 'wheels')
        short.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), window=SECOND)
    assert buffer.insert_from('wheels', 'odom', 'base', 3 * SECOND,
                              Pose(x=float('nan')))[0].kind is Kind.NOT_FINITE
    assert buffer.sources_of('nobody') == []


# --- after a lagging source, a dead one, and in files

def test_smoothed_while_a_source_is_awaited_has_what_lookups_have():
    buffer = fed(SECOND, 'wheels', 'visual')
    feed(buffer, SECOND, 2 * SECOND, 'wheels')
    assert buffer.switch('base', to='visual', **LIMITS) is None
    for stamp in (0, SECOND, 2 * SECOND):
        assert_same_pose(buffer.smoothed().lookup_at('odom', 'base', stamp), wheels(stamp))


def test_switch_to_a_source_that_is_dead_is_refused():
    buffer = fed(SECOND, 'wheels', 'visual')
    feed(buffer, SECOND, 5 * SECOND, 'wheels')
    with pytest.raises(InvalidArgumentException, match='has sent nothing since'):
        buffer.switch('base', to='visual')
    assert active(buffer) == ['wheels']


def test_snapshots_and_files_keep_the_sources(tmp_path):
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.switch_by_rule('base', max_age=100 * MS, **LIMITS)
    feed(buffer, SECOND, 2 * SECOND, 'visual')
    buffer.save(tmp_path / 'tree')
    expected = buffer.smoothed().lookup_at('odom', 'base', 2 * SECOND)
    sources = buffer.sources_of('base')
    still = buffer.snapshot()
    feed(buffer, 2 * SECOND, 3 * SECOND, 'visual')
    for tree in (still, load(tmp_path / 'tree'), pickle.loads(pickle.dumps(still))):
        assert tree.sources_of('base') == sources
        assert tree.smoothed().lookup_at('odom', 'base', 2 * SECOND) == expected
        assert_same_pose(tree.smoothed().lookup_at('odom', 'base', 0), visual(0))


def test_removed_frame_has_no_sources():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.remove_frame('base')
    assert buffer.sources_of('base') == []
    feed(buffer, SECOND, 2 * SECOND, 'visual')
    assert active(buffer) == ['visual'] and len(buffer.sources_of('base')) == 1
    buffer.clear()
    assert buffer.sources_of('base') == []


def test_plain_insertion_beside_sources_is_reported_once():
    buffer = fed(SECOND, 'wheels', 'visual')
    buffer.insert('odom', 'base', SECOND + MS, Pose(), authority='somebody')
    told = feed(buffer, SECOND, 2 * SECOND, 'wheels', 'visual')
    assert [(one.kind, one.authority) for one in told] == [(Kind.TWO_PUBLISHERS, 'somebody')]
    assert 'insert_from' in told[0].detail


# --- back to a better one

def test_better_source_that_is_steady_again_is_gone_back_to():
    buffer = fed(SECOND, 'visual', 'wheels')
    buffer.switch_by_rule('base', max_age=100 * MS, prefer=['visual'], steady=SECOND, **LIMITS)
    told = feed(buffer, SECOND, 2 * SECOND, 'wheels')
    assert [one.kind for one in told] == [Kind.SOURCE_SILENT] and active(buffer) == ['wheels']
    assert not feed(buffer, 2 * SECOND, 2_900 * MS, 'wheels', 'visual')
    told = feed(buffer, 2_900 * MS, 4 * SECOND, 'wheels', 'visual')
    assert [(one.kind, one.authority) for one in told] == [(Kind.SOURCE_PREFERRED, 'wheels')]
    assert 3 * SECOND <= told[0].stamp < 3_200 * MS and active(buffer) == ['visual']
    assert_never_jumps(buffer, 4 * SECOND)
    with pytest.raises(InvalidArgumentException, match='prefer'):
        buffer.switch_by_rule('base', max_age=MS, prefer='visual')


def test_better_source_that_moves_otherwise_is_not_gone_back_to():
    buffer = fed(SECOND, 'slipping', 'visual', 'third')
    buffer.switch_by_rule('base', max_age=SECOND, gate=(0.1, 0.1), prefer=['slipping'],
                          steady=100 * MS, **LIMITS)
    feed(buffer, SECOND, 4 * SECOND, 'slipping', 'visual', 'third')
    assert active(buffer) == ['visual']
