# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A state machine: no query sleeps whose result is available, or will never be.

Random trees whose frames change parents, get late data, end, are removed and cleared, with
many waiting queries. After every operation, the sleeping queries are compared with the
results of lookups at that moment.
"""

from itertools import pairwise

from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule, RuleBasedStateMachine
from tf_tree_py import BufferCore
from tf_tree_py.core import LATEST, PastExtrapolationException, Pose, TransformException
from tf_tree_py.core.buffer.waiting import Inquiry

CACHE_TIME = 20
FRAMES = ['a', 'b', 'c', 'd', 'e']
frames = st.sampled_from(FRAMES)
stamps = st.integers(-3, 40)


class Sleeper:
    """A query that is repeated whenever it is woken, as futures and threads do."""

    def __init__(self, buffer, name, query):
        self.buffer, self.name, self.query = buffer, name, query
        self.inquiry = Inquiry(buffer.waiting, self.noted, self.ask)
        self.tries = 0
        self.finished = False
        self.ask()

    def ask(self):
        self.tries += 1
        try:
            self.finished = self.inquiry.ask() is not None
        except TransformException:
            self.finished = True

    def noted(self):
        try:
            self.answer = self.query()
        except TransformException as error:
            self.answer = error
            raise
        return self.answer

    @property
    def sleeps(self):
        return self.inquiry.places

    def should_sleep(self):
        """Return whether a lookup now fails with an error that later data may resolve."""
        try:
            self.query()
        except TransformException as error:
            return error.blocked_on is not None
        return False


class WaitsMachine(RuleBasedStateMachine):
    """
    A buffer of few frames, and sleepers that are created when a query fails.

    :ivar buffer: the buffer that is changed.
    :ivar asked: that in which the sleepers look; the same, unless a subclass says so.
    """

    def make(self):
        self.buffer = self.asked = BufferCore(CACHE_TIME)

    @initialize(begins=st.lists(st.integers(0, 12), min_size=4, max_size=4))
    def begin(self, begins):
        """Insert the chain a, b, c, d, e, each edge with two samples."""
        self.make()
        self.sleepers = []
        self.newest = 0
        for (parent, child), stamp in zip(pairwise(FRAMES), begins, strict=True):
            self.insert(parent, child, stamp)
            self.insert(parent, child, stamp + 4)

    def insert(self, parent, child, stamp, static=False):
        self.buffer.insert(parent, child, stamp, Pose(1.0), static=static)
        self.newest = max(self.newest, stamp)

    def wait(self, name, query):
        sleeper = Sleeper(self.asked, name, query)
        if sleeper.sleeps:
            self.sleepers.append(sleeper)

    def moving_edge(self, data):
        return data.draw(st.sampled_from(
            [edge for edge in self.buffer.edges() if not edge.static]))

    moves = precondition(lambda self: any(not edge.static for edge in self.buffer.edges()))

    @moves
    @rule(data=st.data(), ahead=st.integers(0, 8))
    def go_on(self, data, ahead):
        edge = self.moving_edge(data)
        self.insert(edge.parent, edge.child, edge.latest + ahead)

    @moves
    @rule(data=st.data(), back=st.integers(0, CACHE_TIME + 1))
    def come_late(self, data, back):
        edge = self.moving_edge(data)
        self.insert(edge.parent, edge.child, edge.latest - back)

    @moves
    @rule(data=st.data(), parent=frames, back=st.integers(-8, CACHE_TIME + 1))
    def hang_elsewhere(self, data, parent, back):
        edge = self.moving_edge(data)
        self.insert(parent, edge.child, edge.latest - back)

    @rule(stamp=st.integers(0, 5))
    def all_go_on(self, stamp):
        now = self.newest + stamp
        for edge in self.buffer.edges():
            if not edge.static:
                self.insert(edge.parent, edge.child, now)

    @rule(parent=frames, child=frames, back=st.integers(-5, CACHE_TIME + 1))
    def arrive_anywhere(self, parent, child, back):
        self.insert(parent, child, self.newest - back)

    @rule(what=st.integers(0, 11), parent=frames, child=frames)
    def upset(self, what, parent, child):
        """Perform a rare operation, or none."""
        if what == 0:
            self.insert(parent, child, 0, static=True)
        elif what == 1:
            self.buffer.remove_frame(child)
        elif what == 2:
            self.buffer.clear()

    @rule(to=frames, source=frames, stamp=st.one_of(st.just(LATEST), stamps))
    def wait_for_one(self, to, source, stamp):
        self.wait((to, source, stamp), lambda: self.asked.lookup(to, source, stamp))

    @rule(to=frames, source=frames, fixed=frames, stamp=stamps,
          later=st.one_of(st.just(LATEST), stamps))
    def wait_for_two_times(self, to, source, fixed, stamp, later):
        self.wait((to, later, source, stamp, fixed), lambda: self.asked.lookup_full(
            to, later, source, stamp, fixed))

    @invariant()
    def who_sleeps_has_reason_to(self):
        for sleeper in self.sleepers:
            assert not sleeper.sleeps or sleeper.should_sleep(), sleeper.name
        self.sleepers = [sleeper for sleeper in self.sleepers if sleeper.sleeps]
        assert len(self.asked.waiting) == len(self.sleepers)


# --- earlier findings, as readable tests


def sleeper(buffer, *arguments):
    asked = Sleeper(buffer, arguments, lambda: buffer.lookup(*arguments))
    assert asked.sleeps
    return asked


def test_late_sample_of_the_edge_that_was_ahead_answers_the_latest():
    buffer = BufferCore(100)
    buffer.insert('a', 'b', 8, Pose(8.0))
    buffer.insert('a', 'b', 10, Pose(10.0))
    buffer.insert('b', 'c', 5, Pose())
    asked = sleeper(buffer, 'a', 'c')
    buffer.insert('a', 'b', 4, Pose(4.0))
    assert asked.answer == Pose(5.0)


def test_slower_edge_of_a_frame_that_was_hung_elsewhere_answers_the_latest():
    """At the newest common time, 10, the parent of base was still old, whose pose is unknown."""
    for known in (False, True):
        buffer = BufferCore(100)
        if known:
            buffer.insert('world', 'old', 0, Pose(), static=True)
        buffer.insert('old', 'base', 10, Pose(1.0))
        buffer.insert('odom', 'base', 20, Pose(2.0))
        buffer.insert('map', 'odom', 10, Pose())
        asked = sleeper(buffer, 'map', 'base')
        buffer.insert('map', 'odom', 30, Pose())
        assert asked.answer == Pose(2.0)


def test_blocker_above_the_meeting_point_is_not_waited_for():
    """The hand was on the table; the edge above both, world -> robot, is late but irrelevant."""
    buffer = BufferCore(100)
    buffer.insert('world', 'robot', 5, Pose())
    buffer.insert('world', 'table', 5, Pose())
    for stamp in (5, 30):
        buffer.insert('robot', 'arm', stamp, Pose(1.0))
    buffer.insert('table', 'hand', 10, Pose(1.0))
    buffer.insert('arm', 'hand', 20, Pose(2.0))
    asked = sleeper(buffer, 'arm', 'hand', 25)
    assert asked.answer.child == 'hand'
    buffer.insert('arm', 'hand', 25, Pose(2.0))
    assert asked.answer == Pose(2.0)


def test_wait_ends_when_another_edge_drops_its_stamp():
    """The edge map -> odom has stopped; odom -> base continues, and the stamp expires in it."""
    buffer = BufferCore(10)
    for stamp in (1, 3):
        buffer.insert('odom', 'base', stamp, Pose())
    buffer.insert('map', 'odom', 1, Pose())
    asked = sleeper(buffer, 'map', 'base', 2)
    for stamp in range(4, 15):
        buffer.insert('odom', 'base', stamp, Pose())
    assert isinstance(asked.answer, PastExtrapolationException)
    assert (asked.answer.child, asked.answer.blocked_on) == ('base', None)


def test_wait_between_two_times_ends_when_one_half_is_dropped():
    buffer = BufferCore(10)
    for stamp in (1, 2):
        buffer.insert('map', 'arm', stamp, Pose())
        buffer.insert('map', 'base', stamp, Pose())
    asked = Sleeper(buffer, '', lambda: buffer.lookup_full('arm', 9, 'base', 1, 'map'))
    assert asked.sleeps
    for stamp in range(3, 20):
        buffer.insert('map', 'base', stamp, Pose())
    assert (asked.answer.child, asked.answer.blocked_on) == ('base', None)


def test_unrelated_transforms_wake_nobody():
    buffer = BufferCore(100)
    buffer.insert('map', 'base', 10, Pose())
    buffer.insert('map', 'other', 10, Pose())
    buffer.insert('base', 'arm', 10, Pose())
    asked = sleeper(buffer, 'map', 'base', 20)
    for stamp in range(11, 20):
        for edge in (('map', 'other'), ('base', 'arm'), ('map', 'base')):
            buffer.insert(*edge, stamp, Pose())
    assert asked.tries == 1
