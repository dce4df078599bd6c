# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Registers our functions with an installed tf2_ros, so that it can transform messages.

Our own tf2_ros knows them without registration.
"""

from types import ModuleType
from typing import Any

from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
from tf_tree_py.ros.messages.registry import TransformRegistration


def register(messages: ModuleType) -> None:
    """Register the messages of a package with tf2_ros, if that is not ours."""
    # The one that is found on Python's path.
    import tf2_ros
    if tf2_ros.TransformRegistration is TransformRegistration:
        return
    for kind, transformer in TRANSFORMERS.items():
        if getattr(messages, kind.__name__, None) is kind:
            tf2_ros.TransformRegistration().add(kind, transformer)
            tf2_ros.ConvertRegistration().add_to_msg(kind, to_msg_msg)
            tf2_ros.ConvertRegistration().add_from_msg(kind, from_msg_msg)


def to_msg_msg(msg: Any) -> Any:
    """Return a message as it is: tf2 needs a converter also for messages."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """Return a message as it is, likewise."""
    return msg
