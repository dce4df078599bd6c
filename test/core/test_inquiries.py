# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The queues of a buffer and those that wait in them, alone and without threads."""

import threading

import pytest
from tf_tree_py.core import Pose, TransformException
from tf_tree_py.core.buffer.waiting import call_all, Inquiry, Waiting, wake_all, WallDeadline
from tf_tree_py.core.tree.tree import Tree

SECOND = 10**9


class Query:
    """A query that fails as long as it has no answer."""

    def __init__(self, *blockers):
        self.blockers = list(blockers)
        self.answers = []
        self.asked = 0

    def __call__(self):
        self.asked += 1
        if self.answers:
            return self.answers.pop()
        raise TransformException('no answer', blocked_on=self.blockers or None)


class Asking(Inquiry):
    """An inquiry whose query tests can change."""

    def __init__(self, waiting, query, wake):
        super().__init__(waiting, query, wake)
        self.query = query


class Deadline:
    """A deadline at which something may happen, that passes at the last of its waits."""

    def __init__(self, *during):
        self.during = list(during)

    def wait(self, event):
        if not self.during:
            return False
        self.during.pop(0)()
        assert event.is_set()
        return True

    def elapsed_s(self):
        return 1.5


@pytest.fixture
def waiting():
    return Waiting(threading.RLock())


def inquiry_of(waiting, woken, name, *blockers):
    inquiry = Asking(waiting, Query(*blockers), lambda: woken.append(name))
    assert inquiry.ask() is None
    return inquiry


def tree_of(**newest):
    tree = Tree(10 * SECOND, 9, 9)
    for child, stamp in newest.items():
        tree.insert('map', child, stamp, tuple(Pose()), '', False)
    return tree


def test_all_are_called_and_the_first_error_is_raised():
    called = []

    def call(number):
        called.append(number)
        if number in (2, 3):
            raise (SystemExit if number == 2 else KeyError)(number)

    with pytest.raises(SystemExit) as raised:
        call_all(lambda number=number: call(number) for number in range(5))
    assert (called, raised.value.code) == ([0, 1, 2, 3, 4], 2)
    assert call_all([lambda: 5]) is None
    with pytest.raises(KeyError):
        call_all([lambda: call(3), lambda: call(2)])


# --- the queues

def test_those_whose_stamp_was_reached_are_woken_in_its_order(waiting):
    woken = []
    for name, *blockers in (('late', ('a', 9)), ('other', ('b', 1)), ('second', ('a', 5)),
                            ('third', ('a', 5), ('b', 7)), ('first', ('a', 4), ('a', 8)),
                            ('next', ('a', 6))):
        inquiry_of(waiting, woken, name, *blockers)
    assert len(waiting) == 6
    for latest, names in ((3, []), (5, ['first', 'second', 'third']), (5, []), (6, ['next']),
                          (8, []), (9, ['late'])):
        waiting.change(tree_of(a=latest), lambda: ['a', 'unknown'], lambda: None)
        assert woken == names
        del woken[:]
    assert len(waiting) == 1
    waiting.change(tree_of(a=latest), lambda: ['b'], lambda: None)
    assert woken == []
    waiting.change(tree_of(b=1), lambda: ['b'], lambda: None)
    assert (woken, len(waiting)) == (['other'], 0)


def test_edge_without_data_wakes_nobody(waiting):
    woken, tree = [], tree_of(a=9)
    inquiry_of(waiting, woken, 'one', ('a', 5))
    tree.clear('why')
    assert waiting.change(tree, lambda: ['a'], lambda: None) is None
    assert woken == []


@pytest.mark.parametrize('structure', [False, True])
def test_change_of_the_structure_wakes_all(waiting, structure):
    woken, tree = [], tree_of(a=5)
    for name, blocker in (('one', ('a', 9)), ('other', ('b', 9)), ('last', (None, 0))):
        inquiry_of(waiting, woken, name, blocker)
    frame = 'new' if structure else 'a'
    waiting.change(tree, lambda: [frame], tree.insert, 'map', frame, 6, tuple(Pose()), '', False)
    assert woken == (['one', 'other', 'last'] if structure else [])
    assert len(waiting) == (0 if structure else 3)


def test_change_asks_for_its_frames_only_if_somebody_waits(waiting):
    asked = []

    def children():
        asked.append(len(waiting))
        return ['a']

    assert waiting.change(tree_of(a=5), children, divmod, 7, 2) == (3, 1)
    assert asked == []
    woken = []
    inquiry_of(waiting, woken, 'one', ('a', 5))
    with pytest.raises(ZeroDivisionError):
        waiting.change(tree_of(a=5), children, divmod, 7, 0)
    assert (asked, woken) == ([1], ['one'])


def test_entering_again_replaces_the_old_places(waiting):
    woken = []
    inquiry = inquiry_of(waiting, woken, 'one', ('a', 5), ('b', 6))
    assert sorted(inquiry.places) == [('a', 5), ('b', 6)]
    first = inquiry.number
    inquiry.query.blockers[:] = [('c', 7), ('c', 7)]
    assert inquiry.ask() is None
    assert inquiry.places == (('c', 7),)
    assert (inquiry.number, len(waiting)) == (first + 1, 1)
    waiting.change(tree_of(a=9, b=9), lambda: 'ab', lambda: None)
    assert woken == []
    waiting.change(tree_of(c=7), lambda: 'c', lambda: None)
    assert (woken, inquiry.places, len(waiting)) == (['one'], (), 0)


def test_sleep_ends_while_somebody_waits_or_once_by_hand(waiting):
    assert not waiting.sleep_until_somebody(0.0)
    waiting.end_sleep()
    assert [waiting.sleep_until_somebody(0.0) for _ in range(2)] == [True, False]
    one, other = (inquiry_of(waiting, [], name, ('a', 5)) for name in ('one', 'other'))
    assert [waiting.sleep_until_somebody(0.0) for _ in range(2)] == [True, True]
    one.end()
    assert waiting.sleep_until_somebody(0.0)
    other.end()
    other.end()
    assert not waiting.sleep_until_somebody(0.0)
    assert len(waiting) == 0


def test_child_process_forgets_those_of_its_parent(waiting):
    woken = []
    inquiries = [inquiry_of(waiting, woken, name, ('a', 5), ('b', 5)) for name in 'xy']
    waiting.repair_in_child()
    assert (len(waiting), woken) == (0, [])
    assert not waiting.sleep_until_somebody(0.0)
    assert [inquiry.places for inquiry in inquiries] == [(), ()]
    inquiries[0].end()
    inquiry_of(waiting, woken, 'z', ('a', 5))
    assert len(waiting) == 1
    waiting.change(tree_of(a=5), lambda: 'a', lambda: None)
    assert woken == ['z']


def test_queues_have_no_truth(waiting):
    with pytest.raises(TypeError):
        bool(waiting)


# --- one that waits

def test_inquiry_is_asked_until_it_has_an_answer(waiting):
    woken = []
    inquiry = inquiry_of(waiting, woken, 'one', ('a', 5))
    waiting.ask_again()
    assert (woken, inquiry.places, inquiry.over) == (['one'], (), False)
    inquiry.query.answers.append(None)
    assert inquiry.ask().value is None
    assert len(waiting) == 0


def test_inquiry_that_does_not_wait_raises(waiting):
    before = []
    inquiry = Inquiry(waiting, Query(('a', 5)), lambda: None)
    with pytest.raises(TransformException, match='no answer'):
        inquiry.ask(once_more=False, before_waiting=lambda: before.append(1))
    assert (len(waiting), before, inquiry.number, inquiry.places) == (0, [], 0, ())
    assert inquiry.ask(before_waiting=lambda: before.append(len(waiting))) is None
    assert (len(waiting), before) == (1, [0])
    hopeless = Inquiry(waiting, Query(), lambda: None)
    with pytest.raises(TransformException, match='no answer'):
        hopeless.ask(before_waiting=lambda: before.append(2))
    assert before == [0]


def test_inquiry_that_is_over_has_no_answer(waiting):
    woken = []
    inquiry = inquiry_of(waiting, woken, 'one', ('a', 5))
    assert inquiry.wake_by(lambda: woken.append('other'))
    wake_all([inquiry])
    assert woken == ['other']
    inquiry.end()
    assert (inquiry.over, inquiry.places, len(waiting)) == (True, (), 0)
    asked = inquiry.query.asked
    assert inquiry.ask() is None
    assert inquiry.query.asked == asked
    assert not inquiry.wake_by(lambda: woken.append('third'))
    wake_all([inquiry])
    assert woken == ['other']


def test_failure_ends_those_that_began_before_it(waiting):
    woken = []
    first = inquiry_of(waiting, woken, 'first', ('a', 5))
    idle = Inquiry(waiting, Query(('a', 5)), lambda: woken.append('idle'))
    failure = TransformException('time restarted')
    waiting.fail(failure)
    assert (woken, len(waiting)) == (['first'], 0)
    raised = []
    for inquiry in (first, idle, first):
        with pytest.raises(TransformException, match='time restarted') as error:
            inquiry.ask()
        raised.append(error.value)
    assert len({id(each) for each in (failure, *raised)}) == 4
    later = inquiry_of(waiting, woken, 'later', ('a', 5))
    assert later.ask() is None
    waiting.fail(TransformException('once more'))
    for inquiry in (first, later):
        with pytest.raises(TransformException, match='once more'):
            inquiry.ask()


# --- threads that wait

def test_answer_that_is_there_begins_no_wait(waiting):
    query = Query(('a', 5))
    query.answers.append(7)
    assert waiting.wait_for(query, lambda error: pytest.fail('it began to wait')) == 7
    assert query.asked == 1


@pytest.mark.parametrize('blockers', [(), (('a', 5),)])
def test_wait_that_cannot_help_does_not_begin(waiting, blockers):
    query, began = Query(*blockers), []
    with pytest.raises(TransformException, match='no answer') as raised:
        waiting.wait_for(query, began.append)
    assert began == [raised.value] * len(blockers)
    assert (raised.value.waited_s, query.asked, len(waiting)) == (None, 1, 0)


def test_error_at_the_beginning_of_a_wait_is_raised_as_it_is(waiting):
    def begin(error):
        raise TransformException('no clock')

    with pytest.raises(TransformException, match='no clock') as raised:
        waiting.wait_for(Query(('a', 5)), begin)
    assert (raised.value.waited_s, len(waiting)) == (None, 0)


def test_wait_asks_once_more_when_its_time_is_up(waiting):
    query = Query(('a', 5))
    with pytest.raises(TransformException, match='no answer') as raised:
        waiting.wait_for(query, lambda error: Deadline())
    assert (raised.value.waited_s, query.asked, len(waiting)) == (1.5, 2, 0)


def test_wait_asks_each_time_it_is_woken(waiting):
    query, seen = Query(('a', 5)), []

    def wake():
        seen.append((len(waiting), query.asked))
        waiting.change(tree_of(a=5), lambda: 'a', lambda: None)

    def answer():
        query.answers.append('it')
        wake()

    assert waiting.wait_for(query, lambda error: Deadline(wake, wake, answer)) == 'it'
    assert (seen, query.asked, len(waiting)) == ([(1, 1), (1, 2), (1, 3)], 4, 0)


def test_wait_that_fails_says_how_long_it_was(waiting):
    query = Query(('a', 5))
    with pytest.raises(TransformException, match='time restarted') as raised:
        waiting.wait_for(query, lambda error: Deadline(
            lambda: waiting.fail(TransformException('time restarted'))))
    assert (raised.value.waited_s, query.asked, len(waiting)) == (1.5, 1, 0)


def test_error_of_another_kind_ends_the_wait(waiting):
    query = Query(('a', 5))

    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        waiting.wait_for(query, lambda error: Deadline(interrupt))
    assert (query.asked, len(waiting)) == (1, 0)


def test_wall_deadline_is_over_at_once_without_time():
    event, deadline = threading.Event(), WallDeadline(-1.0)
    assert not deadline.wait(event)
    event.set()
    assert deadline.wait(event)
    assert 0.0 <= deadline.elapsed_s() < 1000.0
    assert WallDeadline(float('inf')).wait(event)
