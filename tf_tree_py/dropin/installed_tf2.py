# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Registers the functions of this package with an installed tf2_ros, to transform messages.

The tf2_ros of this package needs no registration.
"""

from types import ModuleType
from typing import TypeVar

from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
from tf_tree_py.ros.messages.registry import TransformRegistration

Message = TypeVar('Message')


def register(messages: ModuleType) -> None:
    """Register the messages of a package with tf2_ros, unless that is this package's."""
    # The first one on Python's path.
    import tf2_ros
    if tf2_ros.TransformRegistration is TransformRegistration:
        return
    for cls, transformer in TRANSFORMERS.items():
        if getattr(messages, cls.__name__, None) is cls:
            tf2_ros.TransformRegistration().add(cls, transformer)
            tf2_ros.ConvertRegistration().add_to_msg(cls, to_msg_msg)
            tf2_ros.ConvertRegistration().add_from_msg(cls, from_msg_msg)


def to_msg_msg(msg: Message) -> Message:
    """Return the message itself: tf2 needs a converter also for messages, in both directions."""
    return msg


from_msg_msg = to_msg_msg
