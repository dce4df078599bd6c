# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Results as messages also equal tf2's, including the signs of quaternions."""

from inputs import for_each
from message_tools import stamped_transform
import pytest
from rclpy.duration import Duration
from rclpy.task import Future
from rclpy.time import Time
from recordings import pose_of, problems_of, RECORDINGS, Replay
from tf_tree_py import Buffer
from tf_tree_py.dropin.buffer import Buffer as DropinBuffer
from tf_tree_py.ros.messages.convert import as_nanoseconds, as_pose


class MessageReplay(Replay):
    """A recording, inserted into a buffer and looked up as messages and ROS times."""

    def __init__(self, cls, lookup, lookup_full, *timeout):
        self.cls, self.lookup, self.lookup_full, self.timeout = cls, lookup, lookup_full, timeout

    def run_new(self, operation):
        self.buffer = self.cls(Duration(nanoseconds=operation['cache_time']))

    def run_set(self, operation):
        put = (self.buffer.set_transform_static if operation['static']
               else self.buffer.set_transform)
        message = stamped_transform(
            pose_of(operation), operation['parent'], operation['child'], operation['stamp'])
        put(message, operation['authority'])

    def run_lookup(self, operation):
        return self.answer(self.lookup, operation, operation['target'], operation['source'],
                           Time(nanoseconds=operation['time']))

    def run_lookup_full(self, operation):
        return self.answer(self.lookup_full, operation, operation['target'],
                           Time(nanoseconds=operation['target_time']), operation['source'],
                           Time(nanoseconds=operation['source_time']), operation['fixed'])

    def answer(self, method, operation, *arguments):
        """Return (stamp, pose) of the message that a method or its future gives."""
        found = getattr(self.buffer, method)(*arguments, *self.timeout)
        message = found.result() if isinstance(found, Future) else found
        assert message.header.frame_id == operation['target']
        assert message.child_frame_id == operation['source']
        return as_nanoseconds(message.header.stamp), as_pose(message)

    def run_latest_common_time(self, operation):
        return self.buffer.get_latest_common_time(
            operation['target'], operation['source']).nanoseconds


class CoreMethodsReplay(MessageReplay):
    """The same with the methods of ``tf2_py.BufferCore``."""

    def run_can(self, operation):
        return self.buffer.can_transform_core(
            operation['target'], operation['source'], Time(nanoseconds=operation['time']))[0]


PLAIN = 'lookup_transform', 'lookup_transform_full'


@pytest.mark.parametrize('replay', [
    MessageReplay(Buffer, *PLAIN), MessageReplay(DropinBuffer, *PLAIN),
    CoreMethodsReplay(Buffer, 'lookup_transform_core', 'lookup_transform_full_core'),
    MessageReplay(Buffer, 'wait_for_transform_async', 'wait_for_transform_full_async', Duration()),
], ids=['lookup', 'drop-in', 'core methods', 'futures'])
@for_each(recording=RECORDINGS)
def test_answers_in_messages_are_those_of_tf2(replay, recording):
    answers, problems = problems_of(replay, recording)
    assert answers > 0
    assert not problems, f'{len(problems)} of {answers} differ\n' + '\n'.join(problems[:5])
