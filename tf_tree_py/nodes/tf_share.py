# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Receives transforms once for all processes of a machine, and shares the tree with them."""

from collections.abc import Sequence
import sys
import threading
from typing import Any

from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.task import Future
from tf_tree_py.command.arguments import Parser
from tf_tree_py.command.endings import cannot_after
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.topics.qos import TF_STATIC_TOPIC, TF_TOPIC
from tf_tree_py.ros.topics.reception import reception_of, TOPICS
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import CLOSED, share, SharingTree

from . import share_status
from .bad_input import BadInput
from .parameters import declare, describe, FRAME_PREFIX, Setting
from .robot_topics import topic_of
from .running import ClosingNode, run, spin
from .time_limits import TIME_LIMITS, time_limits

NAME = 'tf_share'

_TOPICS = (
    Setting('tf_topic', TF_TOPIC, 'the topic of moving transforms'),
    Setting('tf_static_topic', TF_STATIC_TOPIC, 'the topic of static transforms'),
)
_NAMES = (
    Setting('static_only', False, 'receive static transforms only'),
    FRAME_PREFIX,
    Setting('strip_frame_prefix', '', 'a prefix to remove before that; edges of frames without it '
                                      'are ignored'),
    Setting('shared_frames', [], 'frames that keep their name, such as [map]'),
    Setting('frame_filter', [], 'the only frames to take, by their published names; if empty, '
                                'all'),
)
SETTINGS = (
    *_TOPICS,
    *_NAMES,
    Setting('buffer_size', 10.0, 'how much history each edge keeps, s', (0.001, 1e9)),
    *TIME_LIMITS,
)

_DESCRIPTION = """\
Receives /tf and /tf_static, and shares the tree in memory with all processes of this user on
this machine. They look up in it as in a buffer of their own, and need not receive anything:

  Buffer(node=self, shared=True)   in a node
  TF_TREE_SHARED=1                 in the environment of an unchanged program
  SharedTree()                     without ROS

Only one process can share the same topics of a domain. Press Ctrl-C to stop."""
_EXAMPLES = (
    ('tf_share', 'share /tf and /tf_static'),
    ('tf_share --ros-args -p buffer_size:=30', 'with 30 s of history'),
    ('tf_share --status', 'who shares what on this machine'),
)


class SharingBuffer(Buffer):
    """A buffer whose tree can lie in shared memory."""

    tree_class = SharingTree


class TfShare(ClosingNode):
    """
    Receives transforms in a thread of its own, and shares them.

    :ivar sharing: the shared tree.
    """

    def __init__(self, **node_options: Any) -> None:
        """
        Start to share.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid, or the tree cannot be shared.
        """
        super().__init__(NAME, **node_options)
        given = declare(self, SETTINGS)
        for setting in _TOPICS:
            topic_of(self, setting.name, given[setting.name])
        self._options = {setting.name: given[setting.name] for setting in (*_TOPICS, *_NAMES)}
        self._options['frame_filter'] = given['frame_filter'] or None
        buffer = SharingBuffer(
            Duration(seconds=given['buffer_size']), self,
            **time_limits(given))
        reception = reception_of(self, **self._options)
        topics: Any = reception[TOPICS]
        if topics[0] == topics[1]:
            raise BadInput(f'tf_topic and tf_static_topic are both {topics[0]}')
        place = Place(self.context.get_domain_id(), topics)
        with cannot_after(SharedTreeException, ending=BadInput):
            self.sharing = share(buffer, place, reception)
        self._closing.callback(self.sharing.close)
        # Nothing arrives from then on, and readers must not take old transforms for new ones.
        self.context.on_shutdown(self.sharing.close)
        self._closing.callback(TransformListener(buffer, self, **self._options).close)
        self.add_post_set_parameters_callback(self._describe)
        self.get_logger().info(f'Sharing {place.what} in {place.memory}')

    def _describe(self, _: list[Parameter]) -> None:
        self.sharing.describe(reception_of(self, **self._options))


def _work(ended: Future) -> None:
    node = TfShare()
    sharing = node.sharing

    def end() -> None:
        sharing.over.wait()
        ended.set_result(None)

    threading.Thread(target=end, name='end of sharing', daemon=True).start()
    spin(node, ended)
    if sharing.why != CLOSED:
        raise BadInput(f'sharing has ended: {sharing.why}')


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the executable; return its exit status.

    :param argv: the whole command line; None: that of this process.
    """
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES, epilog=describe(SETTINGS))
    share_status.add_arguments(parser)
    given = parser.parse_args(parser.own_arguments(argv))
    if given.status:
        return share_status.main(argv)
    if given.json:
        parser.error('--json goes with --status')
    return run(NAME, argv, _work)


if __name__ == '__main__':
    sys.exit(main())
