# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag says which sample has a stamp far from all others, and how to leave it out."""

import warnings

from bags import Message, SECOND, write_ros1, write_ros2
import pytest
from tf_tree_py import stamps_at_rate
from tf_tree_py.bag import BagWarning, open_bag
from tf_tree_py.bag.assembly.lone_samples import LONE_STAMP

BEGIN, COUNT = 1_700_000_000 * SECOND, 100
PERIOD = SECOND // 50
EDGES = (('map', 'odom'), ('odom', 'base'))
DAY = 86_400 * SECOND


def messages(stamp_of=lambda edge, number, stamp: stamp, edges=EDGES, alone=True):
    """Return messages of one edge each, or of all."""
    made = []
    for number in range(COUNT):
        stamp = BEGIN + number * PERIOD
        moved = [(*edge, stamp_of(edge, number, stamp), (number * 0.01, *5 * [0.0], 1.0))
                 for edge in edges]
        made += [Message(stamp + 3_000_000, '/tf', part)
                 for part in ([[each] for each in moved] if alone else [moved])]
    return made


def lone(recording):
    return [oddity for oddity in recording.oddities if oddity.reason == LONE_STAMP]


@pytest.mark.parametrize('alone', [True, False])
@pytest.mark.parametrize('place', [0, 1, 50, COUNT - 1])
@pytest.mark.parametrize(('bad', 'words'), [
    (-2**31 * SECOND, '1901-12-13T20:45:52 UTC, 44,531 days before its neighbours'),
    (0, '1970-01-01T00:00:00 UTC, 19,676 days before its neighbours'),
    (BEGIN - 365 * DAY, '2022-11-14T22:13:20 UTC, 365 days before its neighbours'),
    (BEGIN + 3600 * SECOND, '2023-11-14T23:13:20 UTC, 3')])
def test_sample_is_named_and_can_be_left_out(tmp_path, place, bad, words, alone):
    bag = write_ros2(tmp_path / 'run', messages(lambda edge, number, stamp: (
        bad if (edge, number) == (EDGES[1], place) else stamp), alone=alone))
    with pytest.warns(BagWarning, match=LONE_STAMP):
        recording = open_bag(bag)
    (oddity,) = lone(recording)
    assert (oddity.parent, oddity.child, oddity.times) == ('odom', 'base', 1)
    assert (oddity.first, oddity.last) == (bad, bad)
    assert words in oddity.detail and 'from /tf.' in oddity.detail
    assert f'received at {(BEGIN + place * PERIOD + 3_000_000) / SECOND:.3f}' in oddity.detail
    good = [BEGIN + number * PERIOD for number in range(COUNT) if number != place]
    assert f'tf_export --from {good[0]} --to {good[-1]}, or start and stop' in oddity.detail
    stamps = stamps_at_rate(recording, 'odom', 'base', 50.0, start=good[0], stop=good[-1])
    assert (stamps[0], stamps[-1]) == (good[0], good[-1])


def test_several_of_one_edge_are_one_oddity(tmp_path):
    bad = {30: BEGIN + 3600 * SECOND, 50: 0, 70: BEGIN - 365 * DAY}
    bag = write_ros2(tmp_path / 'run', messages(
        lambda edge, number, stamp: bad.get(number, stamp), EDGES[:1]))
    with pytest.warns(BagWarning, match=LONE_STAMP):
        (oddity,) = lone(open_bag(bag))
    assert (oddity.first, oddity.last, oddity.times) == (0, bad[30], 3)


def test_stamp_among_those_of_the_others_is_said_to_be_in_use(tmp_path):
    def stamp_of(edge, number, stamp):
        return BEGIN + (100 * number + 5000 * (number == 10)) * SECOND

    slow = [message._replace(received=message.transforms[0][2] if number != 10 else
                             BEGIN + 1000 * SECOND)
            for number, message in enumerate(messages(stamp_of, EDGES[:1]))]
    with pytest.warns(BagWarning, match='lone stamp'):
        (oddity,) = lone(open_bag(write_ros2(tmp_path / 'run', slow)))
    assert 'Lookups around its stamp use it' in oddity.detail
    assert 'tf_export' not in oddity.detail


def test_publisher_of_a_ros_1_bag_is_named(tmp_path):
    made = [message._replace(publisher='/wheels') for message in messages(
        lambda edge, number, stamp: 0 if number == 30 else stamp, EDGES[:1])]
    with pytest.warns(BagWarning, match='from /wheels'):
        open_bag(write_ros1(tmp_path / 'run.bag', made))


@pytest.mark.parametrize('case', ['plain', 'paused', 'looped', 'merged', 'simulated'])
def test_healthy_bag_has_none(tmp_path, case):
    made, hour = messages(), 3600 * SECOND

    def shifted(part, received, stamp):
        return [message._replace(received=message.received + received, transforms=[
            (parent, child, at + stamp, pose) for parent, child, at, pose in message.transforms])
            for message in part]

    parts = {
        'plain': [made], 'paused': [made[:1], shifted(made[1:], hour, hour)],
        'looped': [made[-1:], shifted(made, 10 * SECOND, 0), shifted(made[:2], 20 * SECOND, 0)],
        'merged': [made, shifted(made, 30 * DAY, 30 * DAY)],
        'simulated': [shifted(made, 0, 5 * SECOND - BEGIN)],
    }[case]
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        recording = open_bag(write_ros2(tmp_path / 'run', [each for part in parts
                                                           for each in part]))
    assert lone(recording) == []
