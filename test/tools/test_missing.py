# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Hints about missing data: refusals of a new run, without false alarms, and the ROS graph."""

import math

import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import Endpoint, ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.stamp import UNLIMITED
from tf_tree_py.health.checks.graph import GRAPH_CODES, graph_findings
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.ros_graph import NO_GRAPH, RosGraph
from tf_tree_py.reports.explanation import explain
from tf_tree_py.tools.missing import hint_of, hints_of_graph, Refusals

SECOND = 10**9
EDGE = ('odom', 'base_link')


class Watched:
    """A buffer whose refusals are recorded, and the hints about one lookup in it."""

    def __init__(self, recorded=False, cache_time=10 * SECOND):
        self.buffer = BufferCore(cache_time)
        self.refusals = Refusals(recorded=recorded)
        self.buffer.observers.add(self.refusals)

    def send(self, *stamps_s, edge=EDGE, authority='/wheels'):
        for stamp in stamps_s:
            self.buffer.insert(*edge, round(stamp * SECOND), Pose(), authority=authority,
                               strict=False)

    def hints(self, now_s=0, target='odom', source='base_link'):
        explanation = explain(self.buffer, target, source)
        return [hint.text for hint in self.refusals.hints(explanation.edges, now_s * SECOND)]


@pytest.fixture
def watched():
    watched = Watched()
    watched.send(1000.0, 1000.5)
    return watched


def test_new_run_is_named_with_its_sender_and_both_stamps(watched):
    watched.send(1.0, 1.5, 2.0)
    hint, = watched.hints()
    assert hint.startswith(
        '3 transforms of odom -> base_link from /wheels were refused, because they are older than '
        'the buffer keeps: its newest stamp is 1000.500000000, and the newest of theirs '
        '2.000000000. A bag that loops')
    assert 'or, if all edges jumped back, pass Buffer(clear_on_jump_back=...) in your' in hint
    assert hint.endswith('Restart tf_echo to see the new data')


def test_senders_that_are_not_told_apart_are_all_named(watched):
    watched.send(1.0, 1.5, authority='one of /wheels, /ekf')
    assert 'from one of /wheels, /ekf were refused' in watched.hints()[0]
    watched.send(2.0, authority='')
    assert 'of odom -> base_link were refused' in watched.hints()[0]


def test_refusals_in_the_past_are_not_reported_again(watched):
    watched.send(1.0, 1.5)
    assert watched.hints()
    assert not watched.hints()
    watched.send(2.0, 1.2)
    hint, = watched.hints()
    assert hint.startswith('4 transforms')
    assert 'the newest of theirs 2.000000000' in hint


@pytest.mark.parametrize('late', [(1.0,), (1.0, 1.0, 1.0), (3.0, 2.0, 1.0)])
def test_late_samples_and_repeated_stamps_are_no_new_run(watched, late):
    watched.send(*late)
    assert watched.hints() == []


def test_edge_that_another_sender_continues_has_no_hint(watched):
    watched.send(1.0, 1.5, 2.0, authority='/slow_clock')
    watched.send(1001.0)
    assert watched.hints() == []


def test_samples_that_are_refused_for_other_reasons_are_not_old(watched):
    for stamp in (1.0, 1.5):
        watched.send(stamp)
        watched.buffer.insert(*EDGE, round(stamp * SECOND), Pose(x=math.nan), strict=False)
    assert watched.buffer.statistics().refused == 4
    hint, = watched.hints()
    assert hint.startswith('2 transforms of odom -> base_link')


def test_edge_off_the_path_has_no_hint(watched):
    watched.send(1000.0, edge=('base_link', 'arm'))
    watched.send(1.0, 1.5, edge=('base_link', 'arm'))
    assert watched.hints() == []
    assert watched.hints(source='arm')


def test_late_samples_that_are_kept_are_no_refusals(watched):
    watched.send(995.0, 995.5)
    assert watched.hints() == []
    endless = Watched(cache_time=UNLIMITED)
    endless.send(1000.0, 1.0, 1.5)
    assert endless.hints() == []


def test_new_run_is_named_where_an_edge_of_it_makes_the_lookup_fail(watched):
    watched.send(1.0, 2.0, edge=('base_link', 'arm'))
    watched.send(1.0, 2.0)
    assert explain(watched.buffer, 'odom', 'arm').pose is None
    hint, = watched.hints(source='arm')
    assert 'odom -> base_link' in hint


def test_one_stamp_in_the_far_future_is_named_as_the_wrong_one(watched):
    watched.send(1.0, 1.5)
    hint, = watched.hints(now_s=2)
    assert 'The newest stamp is 998.500 s ahead of the clock, and wrong: Buffer(max_future' in hint


def test_recording_is_not_restarted():
    watched = Watched(recorded=True)
    watched.send(1000.0, 1.0, 1.5)
    hint, = watched.hints()
    assert hint.endswith('--at STAMP answers for every stamp of the recording')
    assert 'Restart' not in hint and 'publish' not in hint.partition('slow')[2]


def test_made_up_edges_are_not_recorded_without_end():
    watched = Watched()
    for number in range(1100):
        watched.send(1000.0, 1.0, 1.5, edge=('odom', f'frame_{number}'))
    assert watched.hints(source='frame_999') and not watched.hints(source='frame_1000')


# --- the graph

def elsewhere(*topics, node='/robot1/wheels'):
    return [Endpoint(topic, topic.endswith('static'), node, True, True, False)
            for topic in topics]


def text_of(graph):
    return [hint_of(finding) for finding in graph_findings(graph)]


@pytest.mark.parametrize('topics, fix', [
    (['/robot1/tf'], 'Pass --tf-topic /robot1/tf to read that instead; or start the nodes there '
     'with --ros-args -r /robot1/tf:=/tf, so that all transforms are in one tree'),
    (['/robot1/tf_static'], 'Pass --tf-static-topic /robot1/tf_static to read that'),
    (['/robot1/tf', '/robot1/tf_static'],
     'Pass --tf-topic /robot1/tf --tf-static-topic /robot1/tf_static to read that instead; or '
     'start the nodes there with --ros-args -r /robot1/tf:=/tf -r /robot1/tf_static:=/tf_static'),
    (['/tf'], 'wheels. Pass --tf-topic /tf to read that instead$'),
    (['/robot1/tf', '/robot2/tf', '/robot1/tf_static'],
     'Pass one of them, such as --tf-topic /robot1/tf'),
    ([f'/robot{number}/tf' for number in range(30)], 'and on 26 more topics')])
def test_other_topics_are_named_with_the_options_that_read_them(topics, fix):
    text, = text_of(RosGraph(elsewhere(*topics)))
    assert text.startswith('Transforms (tf2_msgs/msg/TFMessage) are also published on /')
    assert fix in f'{text}$'
    assert len(text) < 600


def test_topic_with_publishers_of_both_kinds_is_one_topic():
    volatile, latched = elsewhere('/a/tf_fixed', '/b/tf_static')
    for endpoints in ([volatile, volatile._replace(static=True)],
                      [latched._replace(static=False)]):
        text, = text_of(RosGraph(endpoints))
        assert f'. Pass --tf-static-topic {endpoints[0].topic} to read' in text
        assert text.count('published on') == 1 and ', on ' not in text


def codes_of(graph, *messages):
    """Return the codes of a doctor that has received these edges, each with whether it moves."""
    doctor = Doctor()
    doctor.graph = graph
    for edge, moves in messages:
        doctor.received(ReceivedMessage(
            Batch([edge], [SECOND], [pack_pose(*Pose())]), SECOND,
            '/tf' if moves else '/tf_static', not moves, '/mounts'))
    return [finding.code for finding in doctor.findings() if finding.code in GRAPH_CODES]


MOUNT, MOVING = (('base_link', 'lidar'), False), (('base_link', 'arm'), True)
ROBOTS = [((f'{robot}/base', f'{robot}/lidar'), False) for robot in ('r1', 'r2')]


@pytest.mark.parametrize('topics, arrived, named', [
    (['/robot1/tf'], [], True),
    (['/robot1/tf'], [MOUNT], True),
    (['/robot1/tf', '/robot1/tf_static'], [MOUNT], True),
    (['/robot1/tf'], ROBOTS, True),
    (['/robot1/tf'], [MOUNT, MOVING], False),
    (['/robot1/tf'], [MOUNT, (('map', 'dock'), True)], True),
    (['/robot1/tf_static'], [], True),
    (['/robot1/tf_static'], [MOUNT], False),
    (['/robot1/tf_static'], [MOUNT, (('map', 'dock'), False)], True),
    ([], [MOUNT], False)])
def test_other_topics_are_named_while_nothing_moves_or_trees_are_separate(topics, arrived, named):
    assert codes_of(RosGraph(elsewhere(*topics)), *arrived) == ['other_topic'] * named


def test_publishers_of_a_topic_are_named_once_and_unknown_ones_are_counted():
    graph = RosGraph([*elsewhere('/a/tf'), *elsewhere('/a/tf'), *elsewhere('/a/tf', node='')])
    assert 'on /a/tf by /robot1/wheels, an unknown node' in text_of(graph)[0]


def test_nothing_is_said_of_a_graph_without_a_fault():
    for graph in (NO_GRAPH, RosGraph(settled=True),
                  RosGraph(clocks=['/gazebo'], clock_users=['/nav'], simulated=True, settled=True),
                  RosGraph(clocks=['/gazebo', '/player'], settled=True),
                  RosGraph(clocks=['/gazebo', '/gazebo'], clock_users=['/nav'], settled=True),
                  RosGraph(clocks=['/gazebo', ''], clock_users=['/nav'], settled=True),
                  RosGraph(clocks=[''], clock_users=['/nav'], settled=True),
                  RosGraph(clock_users=['/nav'], simulated=True, settled=False)):
        assert text_of(graph) == [], graph


def test_clock_that_is_missing_or_there_twice_is_named():
    missing = RosGraph(clock_users=['/nav', '/ekf', '/nav'], settled=True)
    finding, = graph_findings(missing)
    assert (finding.code, finding.severity.value) == ('no_clock', 'warning')
    assert finding.summary == ('nothing publishes /clock, to which /ekf, /nav subscribe, as nodes '
                               'with use_sim_time do')
    finding, = graph_findings(RosGraph(simulated=True, settled=True))
    assert (finding.code, finding.severity.value) == ('no_clock', 'error')
    assert finding.summary == 'this node uses simulated time, and nothing publishes /clock'
    finding, = graph_findings(RosGraph(clocks=['/player', '/gazebo'], simulated=True))
    assert (finding.code, finding.summary) == (
        'two_clocks', '/clock has 2 publishers: /gazebo, /player')


def test_other_topics_are_only_named_where_a_frame_or_an_edge_is_missing(watched):
    graph = RosGraph(elsewhere('/robot1/tf'), clock_users=['/nav'], settled=True)
    watched.send(1000.0, edge=('map', 'dock'))

    def firsts(*lookup):
        explanation = explain(watched.buffer, *lookup) if lookup else None
        return [hint.text.split()[0] for hint in hints_of_graph(graph, explanation)]

    assert firsts('odom', 'base_link', 5 * SECOND) == ['Nothing']
    assert firsts('odom', 'dock') == firsts('odom', 'nowhere') == ['Transforms', 'Nothing']
    assert firsts() == ['Transforms', 'Nothing']
