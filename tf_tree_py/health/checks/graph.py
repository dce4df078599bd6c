# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the ROS graph of a live system: transforms on other topics, and simulated time."""

from collections.abc import Collection, Iterator, Sequence

from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.text import listed

from .case import Case
from .finding import check, Finding, Remark, Severity
from .pieces import are_robots
from .structure import late_joiner, qos_mismatch
from ..measures.thresholds import Thresholds
from ..ros_graph import RosGraph

# At most this many nodes of a topic, and topics, are named.
_MOST = 4


@check(Severity.WARNING,
       catches='transforms on topics that are not read, while none arrive, only static ones '
               'arrive, or trees are not connected; live only',
       cause='a node in a namespace with the relative topic tf, or a remapping',
       fix='read these topics, or let their nodes publish on the usual ones')
def other_topic(case: Case) -> Iterator[Remark]:
    """Find publishers on other topics; where one tree moves, these are other robots."""
    graph = case.graph
    if not (graph.elsewhere and _may_lack_them(case)):
        return
    topics = sorted({one.topic for one in graph.elsewhere})
    parts = [f'on {topic} by {listed(_nodes_of(graph, topic), _MOST)}'
             for topic in topics[:_MOST]]
    more = f', and on {len(topics) - _MOST} more topics' if len(topics) > _MOST else ''
    nodes = tuple(sorted({one.node for one in graph.elsewhere if one.node}))
    yield Remark(
        f'transforms (tf2_msgs/msg/TFMessage) are also published {", ".join(parts)}{more}', (),
        nodes, {'topics': len(topics), 'publishers': len(graph.elsewhere)},
        fix=_how_to_read(topics, _static_topics(graph)))


def _may_lack_them(case: Case) -> bool:
    """Return whether other topics may have what is missing: an edge, or all motion."""
    if len(case.trees) != 1 and not (case.trees and are_robots(case.trees)):
        return True
    static = _static_topics(case.graph)
    return (all(edge.moving is None for edge in case.edges)
            and any(one.topic not in static for one in case.graph.elsewhere))


def _static_topics(graph: RosGraph) -> set[str]:
    """Return the topics with a publisher that is transient local, and those with such a name."""
    return {one.topic for one in graph.elsewhere if one.static or one.topic.endswith('_static')}


def _nodes_of(graph: RosGraph, topic: str) -> list[str]:
    return sorted({one.node or 'an unknown node' for one in graph.elsewhere if one.topic == topic})


def _how_to_read(topics: Sequence[str], static: Collection[str]) -> str:
    """
    Return the options that read these topics, and the remappings that are the alternative.

    :param static: those whose transforms are valid at all times.
    """
    fixed = [topic for topic in topics if topic in static]
    moving = [topic for topic in topics if topic not in static]
    if len(moving) > 1 or len(fixed) > 1:
        option = f'--tf-topic {moving[0]}' if moving else f'--tf-static-topic {fixed[0]}'
        return f'pass one of them, such as {option}'
    options = [f'--tf-topic {topic}' for topic in moving]
    options += [f'--tf-static-topic {topic}' for topic in fixed]
    remappings = [f'-r {topic}:={usual}' for names, usual in ((moving, '/tf'),
                                                              (fixed, '/tf_static'))
                  for topic in names if topic != usual]
    remap = (f'; or start the nodes there with --ros-args {" ".join(remappings)}, so that all '
             'transforms are in one tree' if remappings else '')
    return f'pass {" ".join(options)} to read that instead{remap}'


# --- simulated time

@check(Severity.WARNING,
       catches='simulated time that no node publishes, although nodes use it; live only',
       cause='the simulation or the player of the recording has ended, was started without a '
             'clock, or runs in another ROS domain; or use_sim_time is set on a real robot',
       fix='start the simulation, or play with ros2 bag play --clock; on a real robot set '
           'use_sim_time to false. Until then time stands still for these nodes: their timers '
           'do not fire, and their timeouts do not end')
def no_clock(case: Case) -> Iterator[Remark]:
    """Find that nothing publishes the simulated time of this node, or of others."""
    graph = case.graph
    if not graph.settled or graph.clocks or not (graph.simulated or graph.clock_users):
        return
    users = tuple(sorted(set(graph.clock_users)))
    this = 'this node uses simulated time, and ' if graph.simulated else ''
    others = (f', to which {listed(users, _MOST)} subscribe{"s" if len(users) == 1 else ""}, as '
              'nodes with use_sim_time do' if users else '')
    yield Remark(f'{this}nothing publishes {graph.clock_topic}{others}', (), users,
                 {'publishers': 0, 'subscriptions': len(users)},
                 Severity.ERROR if graph.simulated else None)


@check(Severity.WARNING,
       catches='simulated time of several nodes: /clock has more than one publisher; live only',
       cause='a recording that is played with --clock beside a simulation, two simulations, or '
             'two bridges of one clock',
       fix='stop all but one. Where their times differ, time jumps back and forth, and a '
           'jump back of a second or more clears the buffers')
def two_clocks(case: Case) -> Iterator[Remark]:
    """Find several publishers of a simulated time that is in use."""
    graph = case.graph
    # A node that crashed stays in the graph for a while, beside its replacement of that name.
    nodes = tuple(sorted({node for node in graph.clocks if node}))
    if len(nodes) > 1 and (graph.simulated or graph.clock_users):
        yield Remark(f'{graph.clock_topic} has {len(nodes)} publishers: {listed(nodes, _MOST)}',
                     (), nodes, {'publishers': len(nodes)})


# --- where transforms are missing

_CHECKS = other_topic, no_clock, two_clocks
GRAPH_CODES = frozenset(one.name for one in _CHECKS)


def graph_findings(graph: RosGraph, endpoints: Sequence[Endpoint] = ()) -> list[Finding]:
    """
    Return what a graph shows that may explain missing transforms.

    :param endpoints: those of the topics that are read: whether they match is examined, too.
    """
    case = Case((), {}, {}, (), endpoints, Thresholds(), 0, graph=graph)
    return [finding for one in (late_joiner, qos_mismatch, *_CHECKS)
            for finding in one.findings(case)]
