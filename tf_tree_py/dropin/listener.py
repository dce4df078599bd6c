"""tf2's listeners: ours, where they differ from it."""

import threading
from typing import Any
import weakref

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf_tree_py.ros.buffer import Buffer as OurBuffer
from tf_tree_py.ros.listener import TransformListener as OurListener
from tf_tree_py.ros.qos import TF_STATIC_TOPIC, TF_TOPIC

from .buffer import BufferCore

_UNTIL_SPUN_S = 5.0


class TransformListener(OurListener):
    """
    ``tf2_ros.TransformListener``: it reads in a thread of its own in any case.

    tf2's subscribes on your node by default, so ``rclpy.spin_once`` returns when a
    transform has come, and so it does here. With ``spin_thread=True`` tf2's spins your
    whole node in a thread; this one leaves your node alone.
    """

    def __init__(self, buffer: OurBuffer, node: Node | None, *, spin_thread: bool = False,
                 qos: QoSProfile | int | None = None, static_qos: QoSProfile | int | None = None,
                 tf_topic: str = TF_TOPIC, tf_static_topic: str = TF_STATIC_TOPIC,
                 static_only: bool = False, **options: Any) -> None:
        """
        Begin to listen.

        :param options: those of ``tf_tree_py.TransformListener``; the others likewise.
        """
        super().__init__(buffer, node, qos=qos, static_qos=static_qos, tf_topic=tf_topic,
                         tf_static_topic=tf_static_topic, static_only=static_only, **options)
        if node is None:
            return
        if spin_thread:
            warn_if_nobody_spins(node)
        elif isinstance(buffer, BufferCore):
            buffer.wake_executor_of(node)


class StaticTransformListener(TransformListener):
    """``tf2_ros.StaticTransformListener``: it leaves ``/tf`` alone."""

    def __init__(self, buffer: OurBuffer, node: Node, *, spin_thread: bool = False,
                 static_qos: QoSProfile | int | None = None,
                 tf_static_topic: str = TF_STATIC_TOPIC) -> None:
        super().__init__(buffer, node, spin_thread=spin_thread, static_qos=static_qos,
                         tf_static_topic=tf_static_topic, static_only=True)


def warn_if_nobody_spins(node: Node) -> threading.Timer:
    """Tell a program that leaves the spinning of its node to tf2's listener."""
    reference = weakref.ref(node)

    def look() -> None:
        alive = reference()
        if alive is not None and alive.context.ok() and alive.executor is None:
            alive.get_logger().warning(
                'Nobody spins this node. With spin_thread=True the listener of tf2 does, that of '
                'tf_tree_py does not: if anything here waits for a callback, a timer, a rate or '
                '/clock, begin with threading.Thread(target=rclpy.spin, args=(node,), '
                'daemon=True).start()')

    timer = threading.Timer(_UNTIL_SPUN_S, look)
    timer.daemon = True
    timer.start()
    return timer
