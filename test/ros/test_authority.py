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

"""Names of publishers, also of those that the graph does not know yet: no real one does so."""

from dataclasses import replace
from types import SimpleNamespace

from hand_clock import HandClock
import pytest
from rclpy.topic_endpoint_info import TopicEndpointInfo
from tf_tree_py import Incident
from tf_tree_py.core import Kind
from tf_tree_py.ros.topics import authority
from tf_tree_py.ros.topics.authority import Authority

UNNAMED = ('_NODE_NAMESPACE_UNKNOWN_', '_NODE_NAME_UNKNOWN_')


class Graph:
    """A node that sees what the test says."""

    def __init__(self):
        self.context = SimpleNamespace(ok=lambda: True)
        self.asked = 0
        self.publishers = []

    def get_publishers_info_by_topic(self, topic):
        assert topic == '/tf'
        self.asked += 1
        return [TopicEndpointInfo(node_namespace=namespace, node_name=name)
                for namespace, name in self.publishers]


@pytest.fixture
def graph():
    return Graph()


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(authority, 'time', clock)
    return clock


@pytest.mark.parametrize(('publishers', 'name'), [
    ([], 'unknown publisher of /tf'),
    ([('/', 'localiser')], '/localiser'),
    ([('/robot', 'localiser')], '/robot/localiser'),
    ([('/robot/arm', 'joints'), ('/', 'amcl')], 'one of /amcl, /robot/arm/joints'),
    ([('/', 'amcl'), ('/', 'amcl')], '/amcl'),
    ([UNNAMED], 'unknown publisher of /tf'),
    ([('/', 'amcl'), UNNAMED], 'unknown publisher of /tf'),
])
def test_candidates_are_named(graph, publishers, name):
    graph.publishers = publishers
    assert Authority(graph, '/tf').name() == name


def test_known_name_is_asked_for_once_a_second(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = Authority(graph, '/tf')
    for _ in range(100):
        assert who.name() == '/amcl'
        clock.now += 0.0099
    assert graph.asked == 1
    clock.now += 0.02
    graph.publishers.append(('/', 'slam'))
    assert who.name() == 'one of /amcl, /slam'


def test_name_that_is_about_to_be_told_is_asked_for_again(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = Authority(graph, '/tf')
    odd = [Incident(Kind.LOOP, 'map', 'odom', 1, who.name(), 'because')]
    graph.publishers.append(('/', 'slam'))
    (told,) = who.correct(odd)
    assert told == replace(odd[0], authority='one of /amcl, /slam')
    assert who.name() == 'one of /amcl, /slam'


def test_flood_of_what_is_told_does_not_flood_the_graph(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = Authority(graph, '/tf')
    odd = [Incident(Kind.LOOP, 'map', 'odom', 1, who.name(), 'because')]
    for _ in range(1000):
        assert who.correct([]) == []
    assert graph.asked == 1
    for _ in range(1000):
        who.correct(odd)
        clock.now += 0.001
    assert graph.asked <= 1 + 21


def test_missing_name_is_asked_for_again_soon(graph, clock):
    graph.publishers = [UNNAMED]
    who = Authority(graph, '/tf')
    assert who.name() == who.placeholder
    graph.publishers = [('/', 'amcl')]
    clock.now += 0.1
    assert who.name() == '/amcl'
    assert graph.asked == 2


def test_publisher_that_is_gone_leaves_no_name(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = Authority(graph, '/tf')
    assert who.name() == '/amcl'
    graph.publishers.clear()
    clock.now += 1.1
    assert who.name() == 'unknown publisher of /tf'


def test_dead_context_is_not_asked(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = Authority(graph, '/tf')
    assert who.name() == '/amcl'
    graph.context.ok = lambda: False
    clock.now += 10.0
    assert who.name() == '/amcl'
    assert graph.asked == 1
