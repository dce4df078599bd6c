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
Messages as they arrive, and who sends and hears them: what an observer is told.

A subscription and a recording give the same, so an observer need not know which it watches.
"""

from typing import NamedTuple

from .sample import Batch


class Received(NamedTuple):
    """
    One message with transforms, before anybody judged it.

    :ivar batch: its transforms.
    :ivar received: when it came, nanoseconds, by the clock that its stamps go by; 0: that
        clock had not begun.
    :ivar topic: where it came from.
    :ivar static: whether its transforms are valid at all times.
    :ivar authority: who sent it, or all who may have; '' where nobody knows.
    """

    batch: Batch
    received: int
    topic: str
    static: bool = False
    authority: str = ''


class Endpoint(NamedTuple):
    """
    A publisher of a topic of transforms, or a subscription to it, and its quality of service.

    :ivar topic: of transforms.
    :ivar static: whether they are valid at all times.
    :ivar node: the full name of its node; '' where it is not known.
    :ivar publishes: whether it sends; else it hears.
    :ivar reliable: a reliable subscription does not match a publisher that is not.
    :ivar transient_local: likewise; such a publisher gives late subscribers what it sent.
    """

    topic: str
    static: bool
    node: str
    publishes: bool
    reliable: bool
    transient_local: bool
