# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups for other processes: the action that tf2's ``BufferClient`` and this package's use."""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import RCLError, ServerGoalHandle
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.guard_condition import GuardCondition
from rclpy.node import Node
from rclpy.task import Future
from tf2_msgs.action import LookupTransform
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.errors import TransformException

from .lookup_goal import ACTION_NAME, error_result, service_qos
from ..buffer.buffer import Buffer
from ..buffer.interface import check_is_ours, check_places
from ..messages.convert import as_nanoseconds
from ..waiting.futures import TransformFuture

# How long a result is kept. A client requests it as soon as its goal is accepted, so this may be
# short. It should be short: whenever a goal changes, rclpy's server publishes the states of all
# goals that it still keeps. With tf2's 10 s and several hundred lookups a second, that cuts the
# rate to a third.
RESULT_TIMEOUT_S = 2


class BufferServer(Closable):
    """
    Answers the lookups of other processes from a buffer, as tf2's ``buffer_server`` does.

    Each lookup waits in the buffer, without a thread and without polling, until the transform is
    available, the timeout is over, or the lookup can no longer succeed. The node's executor sends
    the answers, so callbacks that block it delay them.

    A lookup that times out is aborted with TIMEOUT_ERROR and the reason. tf2's server aborts it
    with an identity and no error.
    """

    def __init__(self, buffer: Buffer, node: Node, ns: str = ACTION_NAME) -> None:
        """
        Begin to serve.

        :param buffer: the buffer for the lookups; a ``TransformListener`` fills it.
        :param node: its executor serves.
        :param ns: the action's name.
        :raises TypeError: a buffer of another library, such as tf2's.
        """
        check_is_ours(buffer, Buffer, 'BufferServer')
        check_places('BufferServer(buffer, node)', node=node)
        self._buffer = buffer
        self._node = node
        self._lookups: dict[bytes, TransformFuture] = {}
        self._ended: deque[ServerGoalHandle] = deque()
        # One group, so that a goal is not executed while it is being canceled.
        group = MutuallyExclusiveCallbackGroup()
        self._bell: GuardCondition | None = node.create_guard_condition(self._execute_ended, group)
        self._server = ClosableServer(
            node, LookupTransform, ns, self._answer, callback_group=group,
            handle_accepted_callback=self._accept, cancel_callback=self._cancel,
            goal_service_qos_profile=service_qos(), result_service_qos_profile=service_qos(),
            cancel_service_qos_profile=service_qos(), result_timeout=RESULT_TIMEOUT_S)

    def close(self) -> None:
        """Stop serving; waiting clients find that the server has disappeared."""
        bell, self._bell = self._bell, None
        if bell is None:
            return
        for future in list(self._lookups.values()):
            future.cancel()
        self._node.destroy_guard_condition(bell)
        self._server.destroy()

    def _accept(self, handle: ServerGoalHandle) -> None:
        future = self._look_up(handle.request)
        self._lookups[_key(handle)] = future
        if future.done():
            handle.execute()
        else:
            future.add_done_callback(lambda ended: self._note_end(handle, ended))

    def _look_up(self, goal: LookupTransform.Goal) -> TransformFuture:
        if not goal.advanced:
            return self._buffer.wait_for_transform_async(
                goal.target_frame, goal.source_frame, goal.source_time, goal.timeout)
        return self._buffer.wait_for_transform_full_async(
            goal.target_frame, goal.target_time, goal.source_frame, goal.source_time,
            goal.fixed_frame, goal.timeout)

    def _note_end(self, handle: ServerGoalHandle, future: Future) -> None:
        """Let the executor answer: this may be the thread that receives transforms."""
        # Read the exception: rclpy warns of an unread one, in case the executor has gone.
        future.exception()
        self._ended.append(handle)
        bell = self._bell
        if bell is not None:
            with suppress(InvalidHandle):  # the node is gone
                bell.trigger()

    def _execute_ended(self) -> None:
        while self._ended:
            self._ended.popleft().execute()

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        future = self._lookups.get(_key(handle))
        if future is not None:
            future.cancel()
            if future.cancelled():
                return CancelResponse.ACCEPT
        return CancelResponse.REJECT

    def _answer(self, handle: ServerGoalHandle) -> LookupTransform.Result:
        """Return the outcome of a goal's lookup; an empty result once the server is closed."""
        try:
            return self._end(handle)
        except (InvalidHandle, RCLError):
            if self._bell is not None:
                raise
            return LookupTransform.Result()

    def _end(self, handle: ServerGoalHandle) -> LookupTransform.Result:
        future = self._lookups.pop(_key(handle))
        if future.cancelled():
            handle.canceled()
            return error_result(TransformException('The lookup was canceled'), False)
        error = future.exception()
        if error is None:
            handle.succeed()
            return LookupTransform.Result(transform=future.result())
        # As in tf2's server: without a timeout the goal succeeds, and its result is the error.
        may_wait = as_nanoseconds(handle.request.timeout) > 0
        (handle.abort if may_wait else handle.succeed)()
        return error_result(error, may_wait and error.blocked_on is not None)


class ClosableServer(ActionServer):
    """
    An action server that may be destroyed while an executor is using it.

    With rclpy's own server the executor's ``spin`` would raise, and a goal that is being accepted
    at that moment would keep the server alive.
    """

    _is_destroyed = False

    def __init__(self, *args: Any, **options: Any) -> None:
        """Begin to serve; the arguments are those of ``ActionServer``."""
        # The executors that use the server at this moment, and goals to free after that.
        self._users = 0
        self._detached: list[Any] = []
        super().__init__(*args, **options)

    def destroy(self) -> None:
        self._is_destroyed = True
        self._detach_goals()
        super().destroy()
        self._free_goals()

    def remove_future(self, future: Future) -> None:
        # Of a goal that expires now, the executor may have removed it already.
        with suppress(ValueError):
            super().remove_future(future)

    def _detach_goals(self) -> None:
        """
        End all goals, and keep their memory.

        rcl's server reads it until it is destroyed itself, and that waits for the executor.
        """
        while self._goal_handles:
            goal = self._goal_handles.popitem()[1]
            with goal._lock:
                memory, goal._goal_handle = goal._goal_handle, None
            if memory is not None:
                self._detached.append(memory)

    def _free_goals(self) -> None:
        """Free the goals, without which rcl's server lives on, if no executor uses it."""
        if not self._users:
            while self._detached:
                self._detached.pop().destroy_when_not_in_use()

    def __enter__(self) -> object:
        self._users += 1
        try:
            return super().__enter__()
        except InvalidHandle:
            self._leave()
            raise

    def __exit__(self, *details: object) -> None:
        super().__exit__(*details)
        self._leave()

    def _leave(self) -> None:
        self._users -= 1
        if self._is_destroyed:
            self._free_goals()

    def add_to_wait_set(self, wait_set: object) -> None:
        with self._unless_destroyed():
            super().add_to_wait_set(wait_set)

    def is_ready(self, wait_set: object) -> bool:
        with self._unless_destroyed():
            return bool(super().is_ready(wait_set))
        return False

    def take_data(self) -> dict[str, object]:
        with self._unless_destroyed():
            return super().take_data()  # type: ignore[no-any-return]
        return {}

    async def execute(self, taken_data: dict[str, object]) -> None:
        # Expired goals first: a client may have given the id of one to a new goal. rclpy would
        # forget the new one instead, and the executor would raise KeyError at its end.
        expired = {key: taken_data[key] for key in ('expired',) if key in taken_data}
        others = {key: data for key, data in taken_data.items() if key not in expired}
        with self._unless_destroyed():
            await super().execute(expired)
            await super().execute(others)
        if self._is_destroyed:
            self._detach_goals()
            self._free_goals()

    @contextmanager
    def _unless_destroyed(self) -> Iterator[None]:
        try:
            yield
        except (InvalidHandle, RCLError):
            if not self._is_destroyed:
                raise


def _key(handle: ServerGoalHandle) -> bytes:
    return bytes(handle.goal_id.uuid)
