# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The buffer of users: it has a tree of its own, or shows that of ``tf_share``.

Which of the two is decided when its first listener is made, because that has the topics.
"""

import math
import os
import threading

from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.stamp import format_span, UNLIMITED
from tf_tree_py.recording.flight_recorder import FlightRecorder
from tf_tree_py.shared.directory import Reception
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.mirror import Mirror
from tf_tree_py.shared.shared_tree import attach, SharedTree

from .listener import TransformListener
from .reception import difference, STATIC_ONLY, TOPICS
from ..buffer import buffer as own
from ..buffer.fed_buffer import CLOCK_JUMP_BACK
from ..messages.convert import SpanLike

VARIABLE = 'TF_TREE_SHARED'


class Buffer(own.Buffer):
    """
    A store of transforms, which returns the pose of one frame in another at a given time.

    It has all methods of tf2's buffer and those of ``BufferCore``. With a node it serves
    ``tf2_frames`` and follows the node's clock. A ``TransformListener`` lends it its own clock,
    which advances even while the node's callbacks block. When simulated time goes back by a
    second, the buffer forgets all moving transforms, and all waits fail.

    With ``shared`` it shows the tree that ``tf_share`` receives for all processes of this machine,
    if that runs when the first listener is made; ``is_shared`` says so. Then nothing can be
    inserted, and no listener subscribes. If not, the log has a line with the reason, and this
    process receives the transforms itself.
    """

    def __init__(self, cache_time: Duration | int | None = None, node: Node | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 wall_guard: Duration | None = None, audit: bool = False,
                 max_future: Duration | None = None,
                 clear_on_jump_back: Duration | None = None,
                 clear_on_clock_jump_back: Duration = CLOCK_JUMP_BACK,
                 flight_recorder: FlightRecorder | None = None,
                 max_age: SpanLike = None, shared: float | None = None) -> None:
        """
        Make an empty buffer.

        :param cache_time: the length of the history of each edge; 10 s unless given. ``UNLIMITED``
            keeps everything.
        :param node: serves ``tf2_frames``, logs, and lends its clock.
        :param max_frames: the maximum number of frame names, against a hostile publisher.
        :param max_name_bytes: the maximum length of a frame name in UTF-8, likewise.
        :param wall_guard: with simulated time, the longest wait of a lookup in wall time, in case
            ``/clock`` stands still; None: no limit.
        :param audit: record the lookups; ``self.audit`` has the results, and is None otherwise.
        :param max_future: how far a stamp may be ahead of the buffer's clock; a sample further
            ahead is refused. None: it is accepted, and reported if it is more than 10 s ahead.
        :param clear_on_jump_back: forget moving transforms when stamps jump back by more than
            this, as those of a bag do that is played in a loop without ``/clock``. It has to be
            more than the delay of any publisher, and less than the length of the bag. None: refuse
            such stamps.
        :param clear_on_clock_jump_back: forget moving transforms, and make all waits fail, when
            simulated time goes back by this or more, as in a simulation that is restarted; a
            second unless given, as in tf2. Zero: at any step back.
        :param flight_recorder: keeps the messages that listeners receive, and writes them as a bag
            when a lookup first fails after it had succeeded.
        :param max_age: how old the latest transform may be by the buffer's clock: the default of
            all lookups of the latest; see ``lookup_transform``. None: any age, as in tf2.
        :param shared: show the tree of ``tf_share``, and wait so many seconds for it to start, as
            True for one second. With a node, no listener is needed. None: as the environment
            variable ``TF_TREE_SHARED`` says, such as 1, when a listener is made. Zero or False:
            never.
        :raises ValueError: ``shared`` or ``TF_TREE_SHARED`` is not such a number.
        """
        self._wait_s = _given_s() if shared is None else _checked_s(shared, 'shared')
        # What only the process that receives the transforms can do.
        self._own_options = [name for name, is_given in (
            ('max_future', max_future), ('clear_on_jump_back', clear_on_jump_back),
            ('clear_on_clock_jump_back', clear_on_clock_jump_back != CLOCK_JUMP_BACK),
        ) if is_given]
        self._joining = threading.Lock()
        self._reception: Reception | None = None
        self._mirror: Mirror | None = None
        self._has_stand_in = False
        super().__init__(
            cache_time, node, max_frames=max_frames, max_name_bytes=max_name_bytes,
            wall_guard=wall_guard, audit=audit, max_future=max_future,
            clear_on_jump_back=clear_on_jump_back,
            clear_on_clock_jump_back=clear_on_clock_jump_back, flight_recorder=flight_recorder,
            max_age=max_age)
        self._needed = self.cache_time
        if shared and node is not None:
            TransformListener(self, node)  # the node keeps it alive
            self._has_stand_in = True

    def join(self, node: Node, reception: Reception) -> bool:
        """
        Return whether a listener need not subscribe, because this buffer is filled anyway.

        The first listener decides whether it shows the tree of ``tf_share``.

        :raises SharedTreeException: it does, and the listener would receive something else.
        """
        with self._joining:
            is_first, self._reception = self._reception is None, self._reception or reception
            if self.is_shared:
                self._check_same(reception)
                return True
            if is_first and self._wait_s:
                return self._has_joined(node, reception)
            return self._has_stand_in and reception == self._reception

    @property
    def is_joining(self) -> bool:
        """Return whether a listener is being made, and perhaps waits for ``tf_share``."""
        return self._joining.locked()

    def rejoin(self, reception: Reception) -> None:
        """Compare the tree of ``tf_share`` with what a listener would receive from now on."""
        if self._mirror is not None:
            self._reception = reception
            self._mirror.look_again()

    def _has_joined(self, node: Node, reception: Reception) -> bool:
        why = self._why_own()
        try:
            if why:
                raise SharedTreeException(why)
            topics = reception[TOPICS]
            assert isinstance(topics, list)
            tree = SharedTree(domain_id=node.context.get_domain_id(), topics=topics,
                              wait_s=self._wait_s)
            why = self._why_own() or self._why_unfit(tree.reception, tree.cache_time)
            if why:
                raise SharedTreeException(f'{tree.attachment.who} cannot be used here: {why}')
            self._mirror = attach(
                self, tree.attachment, self.feeds.add_thread,
                lambda directory: self._why_unfit(directory.reception, directory.cache_time))
        except SharedTreeException as error:
            node.get_logger().warning('Receiving transforms in this process, although those of '
                                      f'another were asked for: {error}')
            return False
        node.get_logger().info(f'Looking up transforms in the tree of {tree.attachment.who}')
        return True

    def _why_own(self) -> str:
        """Return why this buffer needs a tree of its own, as a clause; '' if it does not."""
        if self._own_options:
            return f'{self._own_options[0]} concerns the process that receives them'
        if self._tree.frames or self.feeds.side_listeners:
            return 'this buffer has transforms or listeners of its own'
        if self.observers.of_messages:
            return 'observers, such as a flight recorder or diagnostics, need the messages'
        return ''

    def _why_unfit(self, reception: Reception, cache_time: int) -> str:
        """Return why a shared tree is not what this buffer needs, as a clause; '' if it is."""
        assert self._reception is not None
        if self._needed > cache_time:
            needed = 'all' if self._needed == UNLIMITED else format_span(self._needed)
            return f'this buffer has to keep {needed}, and that keeps {format_span(cache_time)}'
        return difference(self._reception, reception)

    def _check_same(self, reception: Reception) -> None:
        assert self._reception is not None
        # A listener to static transforms alone would receive a part of the same.
        unlike = difference({**reception, STATIC_ONLY: self._reception[STATIC_ONLY]}
                            if reception[STATIC_ONLY] else reception, self._reception)
        if unlike:
            raise SharedTreeException(
                'This buffer shows the tree of another process, and no other listener can fill '
                f'it: {unlike}. Use another buffer for it, or Buffer(shared=False)')


def _given_s() -> float:
    return _checked_s(os.environ.get(VARIABLE) or '0', VARIABLE)


def _checked_s(given: float | str, name: str) -> float:
    try:
        seconds = float(given)
    except ValueError:
        seconds = math.nan
    if not 0.0 <= seconds < math.inf:
        raise ValueError(f'{name} has to be how many seconds to wait for tf_share, such as 1, '
                         f'or 0 for never, and not {given!r}')
    return seconds
