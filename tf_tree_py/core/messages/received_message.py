# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What an observer receives: messages as they arrive, and the endpoints of their topics.

Subscriptions and recordings deliver the same types, so an observer works with both.
"""

from typing import NamedTuple

from .sample import Batch


class ReceivedMessage(NamedTuple):
    """
    Transforms that arrive, before any check: a message, or one that a program inserts.

    :ivar batch: its transforms.
    :ivar received: its time of arrival, nanoseconds, by the clock of its stamps; 0: that
        clock had not started, or the message was stored elsewhere before it was delivered.
    :ivar topic: the topic that it arrived on; '' if a program inserted it directly.
    :ivar static: whether its transforms are valid at all times.
    :ivar authority: its sender, or all possible senders; '' if unknown.
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
    :ivar node: the full name of its node; '' if unknown.
    :ivar publishes: whether it is a publisher; otherwise it is a subscription.
    :ivar reliable: a reliable subscription does not match a best-effort publisher.
    :ivar transient_local: whether late subscribers receive earlier messages; a transient-local
        subscription does not match a volatile publisher.
    """

    topic: str
    static: bool
    node: str
    publishes: bool
    reliable: bool
    transient_local: bool
