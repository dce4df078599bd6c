"""
Registers our functions with an installed tf2_ros, so that it can transform messages.

The tf2_ros of this package needs no registration.
"""

from types import ModuleType
from typing import Any

from tf_tree_py.ros.messages.registration import TransformRegistration
from tf_tree_py.ros.messages.stamped import TRANSFORMERS


def register(messages: ModuleType) -> None:
    """Tell the tf2_ros that is installed how the messages of a package are transformed."""
    # Whichever Python's path has.
    import tf2_ros
    if tf2_ros.TransformRegistration is TransformRegistration:
        return
    for kind, transformer in TRANSFORMERS.items():
        if getattr(messages, kind.__name__, None) is kind:
            tf2_ros.TransformRegistration().add(kind, transformer)
            tf2_ros.ConvertRegistration().add_to_msg(kind, to_msg_msg)
            tf2_ros.ConvertRegistration().add_from_msg(kind, from_msg_msg)


def to_msg_msg(msg: Any) -> Any:
    """Return a message as it is: tf2's converter of what is a message already."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """Return a message as it is, likewise."""
    return msg
