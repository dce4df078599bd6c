# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a tree does with each arrival, in whole incidents; its companions, copies and limits.

``test_tree`` has loops and conflicts as users meet them.
"""

import gc

import numpy as np
from policies import HoldNewest
import pytest
from tf_tree_py.core import InvalidArgumentException, Kind, Linear, Pose, Sample
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import Batch, Edges
from tf_tree_py.core.stamp import FOREVER
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.tree import Tree

S = 1_000_000_000


def place(number):
    return (float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def tree_of(*edges, cache_time=100, max_frames=50):
    """Return a tree of edges (parent, child, stamps), static without stamps."""
    tree = Tree(cache_time, max_frames, 30)
    for parent, child, *stamps in edges:
        for stamp in stamps or [0]:
            assert tree.insert(parent, child, stamp, place(stamp), 'first', not stamps) == []
    return tree


def contents(tree):
    """Return all that an insertion may change, without the cached paths."""
    return (list(tree.frames), tree.version, {
        child: (type(history), history.parent, history.authority, history.oldest_stamp,
                history.newest_stamp, len(history))
        for child, history in tree.histories.items()})


def edge(tree, child):
    return contents(tree)[2][child]


def test_new_tree_is_empty():
    tree = Tree(7, 8, 9)
    assert (tree.cache_time, tree.max_frames, tree.max_name_bytes, tree.live, tree.version,
            tree.histories, tree.frames, tree.companions) == (7, 8, 9, False, 0, {}, {}, {})


# --- the common case


def test_sample_that_continues_an_edge_is_appended():
    tree = tree_of(('p', 'c', 10), ('p', 'still'))
    before = contents(tree)
    for sample in (Sample('p', 'unknown', 20, place(1)), Sample('q', 'c', 20, place(1)),
                   Sample('p', 'c', 9, place(1)), Sample('p', 'still', 20, place(1)),
                   Sample('p', 'c', 20, (0.0,) * 7), Sample('p', 'c', 20, place('nan'))):
        assert tree.append(sample, 'second') is False
        assert contents(tree) == before
    assert tree.append(Sample('p', 'c', 10, place(3)), 'second') is True
    assert tree.append(Sample('p', 'c', 20, place(5)), 'third') is True
    assert contents(tree)[:2] == before[:2]
    assert edge(tree, 'c') == (Samples, 'p', 'third', 10, 20, 3)
    assert tree.histories['c'].sample(20) == place(5)
    assert tree.histories['c'].sample(15)[0] == 4.0


@pytest.mark.parametrize('edges_of', [list, Edges])
def test_batch_is_appended_up_to_the_first_that_does_not_continue(edges_of):
    tree = tree_of(('p', 'a', 10), ('a', 'b', 10), ('a', 'c', 10), ('a', 'late', 60))
    poses = [pack_pose(*place(number)) for number in range(3)]
    edges = edges_of([('p', 'a'), ('a', 'b'), ('a', 'c')])
    for stamp in (20, 30, 40):  # the edges of a layout are found in a cache from the second on
        assert tree.append_batch(Batch(edges, [stamp] * 3, poses), f'at {stamp}') == 3
        assert [edge(tree, child)[2:5] for child in 'abc'] == [(f'at {stamp}', 10, stamp)] * 3
    for others, taken in (([('p', 'a'), ('x', 'b'), ('a', 'c')], 1),
                          ([('p', 'a'), ('a', 'c'), ('a', 'new')], 2),
                          ([('p', 'new'), ('p', 'a'), ('a', 'b')], 0),
                          ([('p', 'a'), ('a', 'late'), ('a', 'c')], 1)):
        assert tree.append_batch(Batch(edges_of(others), [50] * 3, poses), 'x') == taken
    # The same object does not name a history that is no longer there.
    assert tree.insert('q', 'b', 60, place(1), 'at 40', False) == []
    assert tree.append_batch(Batch(edges, [70] * 3, poses), 'y') == 1
    assert [edge(tree, child)[4] for child in 'abc'] == [70, 60, 50]
    tree.remove('a')
    assert tree.append_batch(Batch(edges, [80] * 3, poses), 'y') == 0


@pytest.mark.parametrize(('kinds', 'length', 'kept'), [
    (1, 3, 1), (256, 1, 256), (257, 1, 1), (258, 1, 2), (20, 1000, 20), (21, 1000, 1),
    (41, 1000, 1), (3, 6667, 1), (1, 30_000, 1), (3, 15_000, 1)])
def test_messages_whose_edges_are_kept_are_limited(kinds, length, kept):
    tree = tree_of(('p', 'c', 10))
    layouts = [Edges([('p', 'c')] * length) for _ in range(kinds)]
    pose = pack_pose(*place(1))
    for layout in layouts:
        # Those with an unknown edge are never kept.
        for edges in (layout, Edges([('p', 'c'), ('p', 'unknown')])):
            tree.append_batch(Batch(edges, [20] * len(edges), [pose] * len(edges)), 'x')
    assert sum(layout.key in cache for layout in layouts for cache in caches(tree)) == kept


def caches(tree):
    """Return the dictionaries of a tree whose keys are objects without a meaning."""
    return [each for each in gc.get_referents(tree.__dict__, tree)
            if type(each) is dict and any(type(key) is object for key in each)]


# --- every other arrival


def test_arrivals_without_a_remark():
    tree = tree_of(('r', 'p', 50), ('p', 'c', 100))
    for parent, child, stamp, static, version, expected in (
            ('p', 'c', 110, False, 0, (Samples, 'p', 'next', 100, 110, 2)),
            ('p', 'c', 105, False, 0, (Samples, 'p', 'next', 100, 110, 3)),
            ('p', 'c', 60, False, 1, (Samples, 'p', 'next', 60, 110, 4)),  # older than all
            ('p', 'new', 5, False, 1, (Samples, 'p', 'next', 5, 5, 1)),
            ('new', 'still', 7, True, 1, (StaticHistory, 'new', 'next', 0, 0, 1)),
            ('new', 'still', 8, True, 0, (StaticHistory, 'new', 'next', 0, 0, 1))):
        before = tree.version
        assert tree.insert(parent, child, stamp, place(stamp if stamp != 8 else 7), 'next',
                           static) == []
        assert edge(tree, child) == expected
        assert tree.version - before == version
    assert list(tree.frames) == ['p', 'r', 'c', 'new', 'still']
    # Another pose of a static edge is another object, and cached paths forget the old one.
    before, old = tree.version, tree.histories['still']
    assert tree.insert('new', 'still', 8, place(1), 'last', True) == []
    assert tree.histories['still'] is not old
    assert (tree.version, tree.histories['still'].sample(0)) == (before + 1, place(1))


def test_frame_that_changes_its_parent_back_and_forth():
    tree = tree_of(('r', 'p', 50), ('r', 'q', 50), ('p', 'c', 10, 20))
    versions = [tree.version]
    for parent, stamp in (('q', 30), ('q', 40), ('q', 40), ('q', 35), ('p', 50), ('p', 60)):
        assert tree.insert(parent, 'c', stamp, place(stamp), 'first', False) == []
        versions.append(tree.version)
        assert tree.histories['c'].authority == 'first'
    # A sample that continues the newest parent changes no path.
    assert np.diff(versions).tolist() == [1, 0, 0, 1, 1, 0]
    assert list(tree.histories['c'].parents_between(0, 99)) == [
        ('p', 10, 30), ('q', 30, 50), ('p', 50, FOREVER)]


def test_refusal_of_an_old_sample_in_full():
    tree = tree_of(('p', 'c', 5 * S, 10 * S), cache_time=4 * S)
    for parent in 'pq':
        assert tree.insert(parent, 'c', 6 * S - 1, place(1), 'late', False) == [Incident(
            Kind.OLD_DATA, parent, 'c', 6 * S - 1, 'late',
            'its stamp 5.999999999 is 4.000 s older than the newest, 10.000000000, and the buffer '
            "keeps 4.000 s; the last publisher was 'first'", 10 * S)]
    assert tree.insert('p', 'c', 6 * S, place(1), 'late', False) == []
    assert edge(tree, 'c') == (Samples, 'p', 'late', 6 * S, 10 * S, 2)


def test_refusal_of_a_loop_in_full():
    tree = tree_of(('r', 'a', 10), ('a', 'b'), ('b', 'c', 10))
    before = contents(tree)
    assert tree.insert('c', 'r', 10, place(1), 'intruder', False) == [Incident(
        Kind.LOOP, 'c', 'r', 10, 'intruder',
        'each frame the child of the next, r -> c -> b -> a -> r is a loop; kept: '
        "'b' -> 'c' from 'first', 'a' -> 'b' from 'first', 'r' -> 'a' from 'first'. "
        'Two nodes disagree about which frame is the parent: stop one of the publishers')]
    assert contents(tree) == before


def test_static_edge_determines_its_parent_at_all_times():
    # c was below b until 20; a static edge b -> ... -> c would have closed a loop then.
    tree = tree_of(('b', 'c', 10), ('x', 'y', 10))
    assert tree.insert('y', 'c', 20, place(1), 'first', False) == []
    assert tree.insert('c', 'b', 20, place(1), 'first', False) == []
    tree = tree_of(('b', 'c', 10), ('x', 'y', 10))
    assert tree.insert('y', 'c', 20, place(1), 'first', False) == []
    (incident,) = tree.insert('c', 'b', 20, place(1), 'first', True)
    assert incident.kind is Kind.LOOP
    # A late sample determines it until the next one.
    tree = tree_of(('r', 'b', 10, 30), ('b', 'c', 50))
    assert [each.kind for each in tree.insert('c', 'b', 20, place(1), 'first', False)] == []
    assert list(tree.histories['b'].parents_between(0, 99)) == [
        ('r', 10, 20), ('c', 20, 30), ('r', 30, FOREVER)]


def test_reversal_of_a_silent_edge_in_full():
    tree = tree_of(('a', 'b', 0, S), ('b', 'c'), cache_time=10 * S)
    (incident,) = tree.insert('c', 'a', 4 * S, place(1), 'new', False)
    assert incident.kind is Kind.LOOP  # three intervals are not yet silence
    version = tree.version
    assert tree.insert('c', 'a', 4 * S + 1, place(1), 'new', False) == [Incident(
        Kind.SILENT_EDGE_ENDED, 'c', 'a', 4 * S + 1, 'new',
        "it reverses the edge 'a' -> 'b' from 'first', whose newest sample is 3.000 s older; that "
        'edge ends there, and its past is still available')]
    assert edge(tree, 'b') == (Samples, None, 'first', 0, S, 2)
    assert edge(tree, 'a') == (Samples, 'c', 'new', 4 * S + 1, 4 * S + 1, 1)
    assert tree.version == version + 2
    # Of two silent edges, the one nearest to the new parent ends.
    tree = tree_of(('a', 'b', 0, S), ('b', 'c', 0, S), cache_time=10 * S)
    assert [each.kind for each in tree.insert('c', 'a', 9 * S, place(1), 'new', False)] == [
        Kind.SILENT_EDGE_ENDED]
    assert [edge(tree, child)[1] for child in 'bc'] == ['a', None]
    # A sample that is not the newest of its edge ends none.
    tree = tree_of(('a', 'b', 0, S), ('c', 'd', 0, S), cache_time=10 * S)
    assert tree.insert('x', 'a', 9 * S, place(1), 'new', False) == []
    (incident,) = tree.insert('b', 'a', 8 * S, place(1), 'new', False)
    assert incident.kind is Kind.LOOP


def test_remarks_in_full():
    tree = tree_of(('p', 'c', 10), ('p', 'still'))
    assert tree.insert('q', 'c', 20, place(1), 'second', False) == [Incident(
        Kind.SECOND_PARENT, 'q', 'c', 20, 'second',
        "'first' says that its parent is 'p'; every lookup through it depends on which message "
        'came last')]
    # Each pair of a child and a parent is reported once.
    for number, (parent, kinds) in enumerate((
            ('p', []), ('q', []), ('x', [Kind.SECOND_PARENT]), ('q', []), ('x', []))):
        assert [each.kind for each in tree.insert(
            parent, 'c', 30 + number, place(1), f'node {number}', False)] == kinds
    assert tree.insert('p', 'still', 30, place(1), 'second', False) == [Incident(
        Kind.KIND_CHANGE, 'p', 'still', 30, 'second',
        "it was static from 'first' and is now dynamic; its stored samples were removed")]
    assert edge(tree, 'still') == (Samples, 'p', 'second', 30, 30, 1)
    assert [(each.kind, each.authority) for each in tree.insert(
        'z', 'still', 30, place(1), 'third', True)] == [
        (Kind.KIND_CHANGE, 'third'), (Kind.SECOND_PARENT, 'third')]
    assert edge(tree, 'still') == (StaticHistory, 'z', 'third', 0, 0, 1)


def test_one_of_several_publishers_is_suspected_when_a_frame_returns():
    several = 'one of /a, /b'
    for authority, kinds in ((several, [[], [Kind.SECOND_PARENT], []]), ('tracker', [[], [], []])):
        tree = Tree(100, 50, 30)
        assert tree.insert('p', 'c', 1, place(1), authority, False) == []
        assert [[each.kind for each in tree.insert(
            parent, 'c', 2 + stamp, place(1), authority, False)]
            for stamp, parent in enumerate('qpq')] == kinds
    # A static edge does not know its parents of before.
    tree = Tree(100, 50, 30)
    assert [tree.insert(parent, 'c', 0, place(1), several, True) for parent in 'pqp'] == [[]] * 3
    # Nor does an edge without a parent say anything.
    tree = tree_of(('p', 'c', 1))
    tree.histories['c'].end()
    assert tree.insert('q', 'c', 2, place(1), 'second', False) == []
    tree.clear('why')
    assert tree.insert('p', 'c', 3, place(1), 'third', False) == []


def test_conflicts_are_forgotten_when_they_are_too_many():
    tree = Tree(100, 5000, 30)
    assert tree.insert('first', 'c', 0, place(0), 'a', False) == []

    def reported(parent, stamp):
        return [each.kind for each in tree.insert(parent, 'c', stamp, place(0), f'{stamp}', False)]

    # With each new parent there is one more conflict, and with the first one, two.
    for number in range(1, 1001):
        assert reported(f'p{number}', number) == [Kind.SECOND_PARENT]
    assert reported('p1', 2000) == []
    assert reported('p1001', 2001) == [Kind.SECOND_PARENT]
    assert reported('p1', 2002) == []  # it was the parent of then, and so is in the conflict
    assert reported('p2', 2003) == [Kind.SECOND_PARENT]


# --- names


def test_names_and_their_number_are_limited():
    tree = tree_of(('r', 'a', 1), ('a', 'b', 1), max_frames=4)
    assert tree.insert('x', 'y', 2, place(1), 'flood', False) == [Incident(
        Kind.TOO_MANY_FRAMES, 'x', 'y', 2, 'flood',
        'the buffer already knows 3 frames, its limit (max_frames)')]
    (incident,) = tree.insert('b', 'n' * 31, 2, place(1), 'flood', False)
    assert (incident.kind, incident.stamp, incident.authority) == (Kind.BAD_NAME, 2, 'flood')
    assert tree.insert('b', 'n' * 30, 2, place(1), 'flood', False) == []
    assert list(tree.frames) == ['a', 'r', 'b', 'n' * 30]
    # Known names are not checked again.
    tree.max_name_bytes = 5
    assert tree.insert('a', 'n' * 30, 3, place(1), 'flood', False) == []
    assert [each.kind for each in tree.insert('b', 'z', 3, place(1), 'flood', True)] == [
        Kind.TOO_MANY_FRAMES]


# --- many samples, other histories, interpolations


def test_samples_that_may_change_the_structure_are_not_added_directly():
    tree = tree_of(('r', 'p', 10), ('p', 'c', 50, 60), ('p', 'still'), ('p', 'turned', 50))
    assert tree.insert('r', 'turned', 60, place(1), 'first', False) == []
    tree.interpolate('empty', Linear())
    for parent, child, stamp, expected in (
            ('p', 'c', 60, 'c'), ('p', 'c', 50, 'c'), ('p', 'c', 49, 'c'), ('r', 'c', 60, None),
            ('p', 'new', 60, None), ('p', 'still', 60, None), ('r', 'turned', 70, None),
            ('p', 'empty', 60, None)):
        found = tree.history_to_extend(parent, child, stamp)
        assert found is (tree.histories[expected] if expected else None)
    # Before 50, p was below c: an older sample of c would close a loop then.
    tree = tree_of(('p', 'c', 50, 60), cache_time=1000)
    assert tree.insert('c', 'x', 10, place(1), 'first', False) == []
    tree.histories['p'] = Samples('p', 1000)
    for stamp, parent in ((10, 'x'), (40, 'r')):
        tree.histories['p'].insert(stamp, parent, place(1))
    assert tree.history_to_extend('p', 'c', 50) is tree.histories['c']
    assert tree.history_to_extend('p', 'c', 40) is tree.histories['c']
    assert tree.history_to_extend('p', 'c', 39) is None


def test_history_that_takes_no_samples_is_replaced_by_one_that_does():
    class Fixed(Samples):
        """The samples of a curve, in short."""

        takes_samples = False
        described_as = 'a curve'

    tree = tree_of(('r', 'p', 10))
    curve = Fixed('c', 100)
    curve.insert(10, 'p', place(1))
    assert tree.insert_history(curve, 'p', 10, 'first') == []
    assert tree.history_to_extend('p', 'c', 20) is None
    (incident,) = tree.insert('p', 'c', 20, place(1), 'second', False)
    assert (incident.kind, incident.detail) == (
        Kind.KIND_CHANGE, "it was a curve from '' and is now dynamic; its stored samples were "
                          'removed')
    assert edge(tree, 'c') == (Samples, 'p', 'second', 20, 20, 1)


def test_extended_edge_changes_the_structure_only_before_its_first_sample():
    tree = tree_of(('p', 'c', 50))
    history, poses = tree.histories['c'], np.array([place(1), place(2)])
    for stamps, changes in (([50, 60], 0), ([70, 55], 0), ([80, 49], 1), ([49, 90], 0)):
        before = tree.version
        tree.extend(history, np.array(stamps), poses, f'{stamps}')
        assert tree.version - before == changes
        assert history.authority == f'{stamps}'
    assert (len(history), history.oldest_stamp, history.newest_stamp) == (9, 49, 90)


def test_history_is_replaced_by_another_with_the_same_samples():
    tree = tree_of(('p', 'c', 50))
    history, version = tree.histories['c'], tree.version
    tree.replace(history)
    assert tree.version == version
    twin = history.copy()
    tree.replace(twin)
    assert (tree.histories['c'], tree.version) == (twin, version + 1)


def test_history_of_another_kind_is_inserted_like_an_edge():
    tree = tree_of(('r', 'p', 50), ('p', 'c', 50), ('c', 'd', 50))
    new, version = Samples('c', 100), tree.version
    new.insert(70, 'r', place(3))
    assert tree.insert_history(new, 'r', 70, 'second') == [Incident(
        Kind.SECOND_PARENT, 'r', 'c', 70, 'second',
        "'first' says that its parent is 'p'; every lookup through it depends on which message "
        'came last')]
    assert (tree.histories['c'], tree.version) == (new, version + 1)
    loop = Samples('r', 100)
    loop.insert(70, 'd', place(3))
    (incident,) = tree.insert_history(loop, 'd', 70, 'second')
    assert (incident.kind, incident.parent, incident.child) == (Kind.LOOP, 'd', 'r')
    assert 'r' not in tree.histories
    fresh = Samples('fresh', 100)
    fresh.insert(70, 'base', place(3))
    assert tree.insert_history(fresh, 'base', 70, 'second') == []
    assert list(tree.frames)[-2:] == ['fresh', 'base']
    fixed = StaticHistory('fresh', 'base', place(1))
    (incident,) = tree.insert_history(fixed, 'base', 0, 'third')
    assert incident.detail == ("it was dynamic from '' and is now static; its stored samples were "
                               'removed')


def test_interpolation_is_chosen_also_before_the_first_sample():
    tree = tree_of(('p', 'c', 50), ('p', 'still'))
    policy, version = HoldNewest(5), tree.version
    tree.interpolate('c', policy)
    assert (tree.histories['c'].interpolation, tree.version) == (policy, version + 1)
    tree.interpolate('later', policy)
    assert 'later' not in tree.frames
    assert tree.insert('p', 'later', 60, place(1), 'first', False) == []
    history = tree.histories['later']
    assert (history.interpolation, history.cache_time, history.latest_stamp) == (policy, 100, 65)
    with pytest.raises(InvalidArgumentException, match='The edge p -> still is static'):
        tree.interpolate('still', policy)
    assert tree.remove('c') is True
    tree.interpolate('c', policy)
    assert tree.remove('c') is False
    assert 'c' not in tree.histories


# --- companions, copies, removing


class Noted(Companion):
    """Notes the calls of the tree."""

    def __init__(self):
        self.calls = []

    def copy(self):
        twin = Noted()
        twin.calls = ['a copy']
        return twin

    def clear(self, histories):
        self.calls.append(('clear', histories))

    def remove(self, frame):
        self.calls.append(('remove', frame))

    def structure_changed(self):
        self.calls.append('changed')


def test_companions_are_told_of_every_change():
    tree = tree_of(('p', 'c', 10))
    assert tree.companion(Noted) is None
    noted = tree.companion_or_new(Noted)
    assert tree.companion(Noted) is tree.companion_or_new(Noted) is noted
    plain = tree.companion_or_new(Companion)
    assert (plain.copy(), plain.clear({}), plain.remove('c'), plain.structure_changed()) == (
        None,) * 4
    assert tree.insert('p', 'c', 20, place(1), 'first', False) == []
    assert noted.calls == []
    assert tree.insert('c', 'd', 20, place(1), 'first', False) == []
    assert noted.calls == ['changed']
    tree.remove('unknown')
    assert noted.calls == ['changed']
    tree.remove('d')
    assert noted.calls[1:] == [('remove', 'd'), 'changed']
    tree.clear('why')
    assert noted.calls[3:] == [('clear', tree.histories), 'changed']
    twin = tree.copy()
    assert twin.companion(Noted).calls == ['a copy']
    assert twin.companion(Companion) is None


def test_copy_is_independent():
    tree = tree_of(('p', 'c', 10), ('p', 'still'))
    tree.live = True
    twin = tree.copy()
    assert (twin.cache_time, twin.max_frames, twin.max_name_bytes, twin.live) == (
        100, 50, 30, False)
    assert contents(twin)[0] == contents(tree)[0]
    assert contents(twin)[2] == contents(tree)[2]
    assert twin.insert('p', 'x', 20, place(1), 'first', False) == []
    assert twin.insert('p', 'c', 20, place(1), 'first', False) == []
    assert (list(tree.frames), len(tree.histories['c'])) == (['c', 'p', 'still'], 1)
    assert twin.paths.pose_at('x', 'c', 20) == se3.IDENTITY


def test_cleared_tree_keeps_names_and_static_edges():
    tree = tree_of(('p', 'c', 10), ('p', 'still'), ('still', 'd', 10))
    version = tree.version
    tree.clear('why')
    assert contents(tree) == (['c', 'p', 'still', 'd'], version + 1, {
        'c': (Samples, None, 'first', None, None, 0),
        'still': (StaticHistory, 'p', 'first', 0, 0, 1),
        'd': (Samples, None, 'first', None, None, 0)})
    assert tree.insert('p', 'c', 5, place(1), 'first', False) == []


def test_removed_frame_keeps_its_name_only_as_a_parent():
    tree = tree_of(('r', 'p', 10), ('p', 'c', 10), ('r', 'x', 10))
    assert tree.paths.pose_at('r', 'c', 10)[0] == 20.0
    version = tree.version
    assert tree.remove('p') is True
    assert (list(tree.frames), list(tree.histories)) == (['p', 'r', 'c', 'x'], ['c', 'x'])
    assert tree.version == version + 1
    assert tree.remove('x') is True
    assert (list(tree.frames), list(tree.histories)) == (['p', 'r', 'c'], ['c'])
    assert tree.remove('unknown') is False
    assert tree.version == version + 2


def test_pose_of_a_tree_is_that_of_its_samples():
    tree = tree_of(('r', 'p', 10, 20), ('p', 'c'))
    assert Pose(*tree.paths.pose_at('r', 'c', 15)) == Pose(15.0)
