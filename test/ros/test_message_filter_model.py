# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The message filter compared with one that repeats all lookups after every step."""

from effort import examples
from filter_helpers import check, Inbox, point, run_callbacks
from hypothesis import given, HealthCheck, strategies as st
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros_helpers import at, lasting, move
from tf_tree_py import Buffer, ClockJumpException, TransformException
from tf_tree_py.ros.filtering.drop_reasons import Drop
from tf_tree_py.ros.filtering.message_filter import MessageFilter


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
        if len(self.ready) > self.queue_size:
            self.dropped.append((self.ready.pop(0)[0], Drop.QUEUE_FULL))
        if len(self.waiting) > self.queue_size:
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


@pytest.fixture(scope='module')
def modelled():
    """Return a node and its executor; hypothesis runs all examples in one test."""
    context = Context()
    rclpy.init(context=context, args=[])
    node = Node('modelled', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield node, executor
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


def act(modelled, targets, steps, queue_size, tolerance, *, settle_always=False):
    """
    Perform the steps with a filter and with the model, and compare what they drop.

    :returns: what each delivered, the model first: messages with their transforms, in order.
    """
    node, executor = modelled
    model, buffer, inbox = Naive(targets, queue_size, tolerance), Buffer(), Inbox()
    each = MessageFilter(buffer, node, targets, inbox.take, on_drop=inbox.lose,
                         queue_size=queue_size, tolerance=lasting(tolerance))

    def jump():
        buffer.clear()
        buffer.waiting.fail(ClockJumpException('jumped'))

    def add(frame, seconds):
        each.add(point(seconds, frame, x=float(model.number)))

    actions = {'add': add, 'jump': jump,
               'move': lambda child, seconds: move(buffer, seconds, child=child),
               'settle': lambda: run_callbacks(executor, each)}
    if settle_always:
        steps = [each for step in steps for each in (step, ('settle',))]
    for name, *arguments in steps:
        getattr(model, name)(*arguments)
        actions[name](*arguments)
        check(each.statistics())
    each.close()
    model.close()
    assert len(buffer.waiting) == 0
    # Reasons have no order: a message that was dropped twice would be an error here.
    assert sorted((message.point.x, drop) for message, drop, _ in inbox.dropped) == sorted(
        model.dropped)
    return model.delivered, [
        (message.point.x, [each.transform.translation.x for each in found.values()])
        for message, found in inbox.delivered]


CASES = {'queue_size': st.integers(1, 4), 'tolerance': st.sampled_from([0.0, 0.5])}


@examples(4, suppress_health_check=list(HealthCheck))
@given(steps=steps(30), **CASES)
def test_every_message_fares_as_in_the_naive_model(modelled, steps, queue_size, tolerance):
    """Delivered once, in this order, with this transform; or dropped once, for this reason."""
    expected, delivered = act(modelled, ['map'], steps, queue_size, tolerance)
    assert delivered == expected


@examples(2, suppress_health_check=list(HealthCheck))
@given(steps=steps(9), **CASES)
def test_so_it_does_with_several_targets(modelled, steps, queue_size, tolerance):
    """Messages of two frames whose transforms arrive at the same time have no defined order."""
    results = act(modelled, ['map', 'a'], steps, queue_size, tolerance, settle_always=True)
    frames = ['', *[step[1] for step in steps if step[0] == 'add']]
    expected, delivered = (sorted(them, key=lambda it: frames[int(it[0])]) for them in results)
    assert delivered == expected
