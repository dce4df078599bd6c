# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The part of the ROS graph that may explain missing transforms, as plain data."""

from collections.abc import Sequence
from typing import NamedTuple

from tf_tree_py.core.messages.observers import Endpoint


class RosGraph(NamedTuple):
    """
    The publishers of transforms on topics that are not read, and those of simulated time.

    :ivar elsewhere: the publishers of transforms on other topics than those that are read.
    :ivar clock_topic: the topic of simulated time.
    :ivar clocks: the node of each of its publishers; '' if unknown.
    :ivar clock_users: the nodes that subscribe to it, as those with ``use_sim_time`` do.
    :ivar simulated: whether this node uses simulated time.
    :ivar settled: whether all nodes have had the time to appear. Before that, a missing publisher
        means nothing.
    """

    elsewhere: Sequence[Endpoint] = ()
    clock_topic: str = '/clock'
    clocks: Sequence[str] = ()
    clock_users: Sequence[str] = ()
    simulated: bool = False
    settled: bool = False


NO_GRAPH = RosGraph()
"""That of a recording or a fleet, which shows nothing."""
