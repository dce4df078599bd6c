# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The message filter compared with one that repeats all lookups after every step."""

from effort import examples
from filter_helpers import check, Inbox, point
from hypothesis import example, given, HealthCheck, strategies as st
from ros_helpers import at, lasting, move
from tf_tree_py import Buffer, ClockJumpException, TransformException
from tf_tree_py.ros.filtering.message_filter import Drop, MessageFilter


class Naive:
    """A model of a filter, which repeats all lookups after every step."""

    def __init__(self, targets, queue_size, tolerance):
        self.buffer = Buffer()
        self.targets, self.queue_size, self.tolerance = targets, queue_size, tolerance
        self.number, self.waiting, self.ready, self.delivered, self.dropped = 0, [], [], [], []

    def ask(self, frame, seconds):
        """Return the transforms' x, or the error."""
        try:
            answer = [self.buffer.lookup_transform(target, frame, at(seconds))
                      for target in self.targets]
            for target in self.targets:
                self.buffer.lookup_transform(target, frame, at(seconds + self.tolerance))
        except TransformException as error:
            return error
        return [each.transform.translation.x for each in answer]

    def look_again(self):
        for number, frame, seconds in list(self.waiting):
            answer = self.ask(frame, seconds)
            if isinstance(answer, list):
                self.waiting.remove((number, frame, seconds))
                self.ready.append((number, answer))
            elif answer.blocked_on is None:
                self.waiting.remove((number, frame, seconds))
                self.dropped.append((number, Drop.TOO_OLD))
        while 0 < self.queue_size < len(self.ready):
            self.dropped.append((self.ready.pop(0)[0], Drop.QUEUE_FULL))
        while 0 < self.queue_size < len(self.waiting):
            self.dropped.append((self.waiting.pop(0)[0], Drop.QUEUE_FULL))

    def add(self, frame, seconds):
        self.number += 1
        if frame == '':
            self.dropped.append((self.number, Drop.EMPTY_FRAME))
        else:
            self.waiting.append((self.number, frame, seconds))
            self.look_again()

    def move(self, child, seconds):
        move(self.buffer, seconds, child=child)
        self.look_again()

    def jump(self):
        self.buffer.clear()
        self.dropped += [(number, Drop.CLOCK_JUMPED) for number, *_ in self.waiting]
        self.waiting = []

    def settle(self):
        self.delivered += self.ready
        self.ready = []

    def close(self):
        self.dropped += [(number, Drop.CLOSED) for number, *_ in self.waiting + self.ready]


def steps(latest):
    """Return a strategy for the possible steps, at times up to the latest."""
    seconds = st.integers(1, 2 * latest).map(lambda halves: halves / 2.0)
    return st.lists(max_size=40, elements=st.one_of(
        st.tuples(st.just('add'), st.sampled_from(['a', 'a', 'b', 'nowhere', '']), seconds),
        st.tuples(st.just('move'), st.sampled_from(['a', 'b']), seconds),
        st.tuples(st.sampled_from(['settle', 'settle', 'jump'])),
    ))


def act(node, settle, targets, steps, queue_size, tolerance, *, settle_always=False):
    """
    Perform the steps with a filter and with the model, and compare what they drop.

    :returns: what each delivered, the model first: messages with their transforms, in order.
    """
    model, buffer, inbox = Naive(targets, queue_size, tolerance), Buffer(), Inbox()
    each = MessageFilter(buffer, node, targets, inbox.receive, on_drop=inbox.lose,
                         queue_size=queue_size, tolerance=lasting(tolerance))

    def jump():
        buffer.clear()
        buffer.waiting.fail(ClockJumpException('jumped'))

    def add(frame, seconds):
        each.add(point(seconds, frame, x=float(model.number)))

    actions = {'add': add, 'jump': jump,
               'move': lambda child, seconds: move(buffer, seconds, child=child),
               'settle': lambda: settle(each)}
    if settle_always:
        steps = [each for step in steps for each in (step, ('settle',))]
    for name, *arguments in steps:
        getattr(model, name)(*arguments)
        actions[name](*arguments)
        check(each.statistics())
        assert each.statistics().held == len(model.waiting) + len(model.ready)
    each.close()
    model.close()
    assert len(buffer.waiting) == 0
    # Reasons have no order: a message that was dropped twice would be an error here.
    assert sorted((message.point.x, drop) for message, drop, _ in inbox.dropped) == sorted(
        model.dropped)
    return model.delivered, [
        (message.point.x, [each.transform.translation.x for each in found.values()])
        for message, found in inbox.delivered]


def adding(*seconds):
    return [('add', 'a', each) for each in seconds]


def moving(*seconds):
    """Return steps that move a, and let the executor run after each."""
    return [step for each in seconds for step in (('move', 'a', each), ('settle',))]


CASES = {'queue_size': st.integers(0, 4), 'tolerance': st.sampled_from([0.0, 0.5])}


@examples(4, suppress_health_check=list(HealthCheck))
@given(steps=steps(30), **CASES)
# Each comes in its order, or waits alone; the queue has no end.
@example(moving(1.0) + adding(5.0, 3.0, 4.0, 8.0, 7.0) + moving(6.0, 7.0, 8.0), 0, 0.0)
# A queue is full, of those that wait and of those that are ready.
@example(moving(1.0, 2.0) + adding(3.0, 4.0, 5.0, *[1.5] * 5) + moving(9.0), 2, 0.0)
# Data beyond the stamp must be there, and a stamp becomes too old.
@example(moving(1.0, 2.0) + adding(1.5, 1.75, 0.5) + moving(2.25, 20.0) + adding(0.6), 10, 0.5)
def test_every_message_fares_as_in_the_naive_model(node, settle, steps, queue_size, tolerance):
    """Delivered once, in this order, with this transform; or dropped once, for this reason."""
    expected, delivered = act(node, settle, ['map'], steps, queue_size, tolerance)
    assert delivered == expected


@examples(2, suppress_health_check=list(HealthCheck))
@given(steps=steps(9), **CASES)
def test_so_it_does_with_several_targets(node, settle, steps, queue_size, tolerance):
    """Messages of two frames whose transforms arrive at the same time have no defined order."""
    results = act(node, settle, ['map', 'a'], steps, queue_size, tolerance, settle_always=True)
    frames = ['', *[step[1] for step in steps if step[0] == 'add']]
    expected, delivered = (sorted(them, key=lambda it: frames[int(it[0])]) for them in results)
    assert delivered == expected
