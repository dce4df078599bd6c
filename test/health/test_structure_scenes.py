# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is said about names, parents, publishers and sources, beside each limit."""

from itertools import product

import numpy as np
from small_scenes import every, examined, fixed, poses, refused, said, sent
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.observers import Endpoint, ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.checks.pieces import are_robots, pieces_of
from tf_tree_py.health.doctor import Doctor

TEN_HZ = every(0.1, 60)


def short(code, *messages, **others):
    """Return the severities of findings, each with its edges."""
    return [one.partition(' | ')[0] for one in said(code, *messages, **others)]


# --- pieces

def test_pieces_are_sorted_by_size_and_begin_with_their_first_frame():
    assert pieces_of([]) == []
    assert pieces_of([('x', 'y'), ('a', 'b'), ('b', 'c'), ('u', 'v'), ('b', 'd'), ('e', 'd')]) == [
        ['a', 'b', 'c', 'd', 'e'], ['x', 'y'], ['u', 'v']]
    assert pieces_of([('c', 'd'), ('a', 'b'), ('b', 'c')]) == [['c', 'd', 'b', 'a']]


def test_pieces_are_robots_if_each_has_one_prefix_of_its_own():
    assert are_robots([['one/map', 'one/base'], ['two/map', 'two/base']])
    assert are_robots([['one/map', 'one/base/arm']])
    assert not are_robots([['one/map', 'one/base'], ['one/x', 'one/y']])
    assert not are_robots([['one/map', 'base'], ['two/map', 'two/base']])
    assert not are_robots([['one/map', 'three/base'], ['two/map', 'two/base']])
    assert not are_robots([['one/map', 'one/base'], ['map', 'base']])
    assert not are_robots([['/map', '/base'], ['two/map', 'two/base']])


# --- names

def test_names_that_look_alike():
    assert said('similar_names', fixed('map base_link', node='/urdf'), fixed(
        'base_link arm', node='/arm'), fixed('base_link BaseLink', node='/x'), fixed(
        'map other', node='/y')) == [
        "warning (base_link BaseLink) | /urdf, /arm, /x | 'base_link', 'BaseLink' look like one "
        'frame | names=2 trees=1']
    assert said('similar_names', fixed('map base_link'), fixed('baselink arm'), fixed(
        'base-link tool')) == [
        "error (base_link baselink base-link) | 'base_link', 'baselink', 'base-link' look like "
        'one frame, and their trees are not connected | names=3 trees=3']
    assert said('similar_names', fixed('map base_link'), fixed('baselink arm')) == [
        "error (base_link baselink) | 'base_link', 'baselink' look like one frame, and their "
        'trees are not connected | names=2 trees=2']
    names = 'link_1_1', 'link_11', 'link11', 'Link 1_1', 'link_1__1', 'link1_1'
    assert said('similar_names', fixed('map ' + ', map '.join(
        name.replace(' ', '-') for name in names))) == [
        "warning (link_1_1 Link-1_1 link1_1) | 'link_1_1', 'Link-1_1', 'link1_1' look like one "
        'frame | names=3 trees=1',
        "warning (link_11 link11 link_1__1) | 'link_11', 'link11', 'link_1__1' look like one "
        'frame | names=3 trees=1']


def slashed(parent, child, *names, node=''):
    return [ReceivedMessage(Batch([(parent, child)], [0], [poses(1)[0].tobytes()], names), 1,
                            '/tf_static', True, node)]


def test_leading_slashes():
    assert said('leading_slash', slashed('map', 'base', '/map', '/base', node='/old'),
                slashed('base', 'arm', '/arm', node='/driver'), fixed('x y', node='/new')) == [
        'warning (/arm /base /map) | /old, /driver | published with a leading slash: /arm, '
        '/base, /map | names=3']
    assert said('leading_slash', fixed('map base')) == []


def test_refused_names():
    def found(code, kind, parent, child, times=1):
        return said(code, incidents=[refused(kind, parent, child, times, '/driver'),
                                     refused(Kind.JUMP_BACK, 'x', 'y')])

    assert found('empty_name', Kind.EMPTY_FRAME, '', 'b') == [
        'error (b) | /driver | an empty frame name beside b, once | count=1']
    assert found('empty_name', Kind.EMPTY_FRAME, 'a', '', 2) == [
        'error (a) | /driver | an empty frame name beside a, twice | count=2']
    assert found('empty_name', Kind.EMPTY_FRAME, '', '') == [
        'error () | /driver | an empty frame name on both sides, once | count=1']
    assert found('self_edge', Kind.SELF_EDGE, 'a', 'a') == [
        'error (a) | /driver | a was published as its own parent once | count=1']
    assert found('loop', Kind.LOOP, 'a', 'b', 3) == [
        'error a>b | /driver | a -> b would close a loop, and was refused 3 times: a detail | '
        'count=3']


# --- publishers

def alternating(edges, count=200, apart=1.0, begin=0, end=None, node='', shift=0.02):
    """Return messages of two publishers, of which the other one sends some."""
    stamps = every(0.1, count)
    at = poses(count, x=0.02 * np.arange(count))
    other = slice(begin, end)
    return sent(edges, stamps, at=at, node=node) + sent(
        edges, stamps[other] + from_seconds(shift), at=poses(
            count, x=apart + 0.02 * np.arange(count))[other], node=node)


def driving(edges, count=200):
    return sent(edges, every(0.1, count), at=poses(count, x=0.05 * np.arange(count)))


def test_two_publishers_that_alternate():
    assert said('two_publishers', alternating('odom base', node='/wheels')) == [
        'error odom>base | /wheels | odom -> base alternates between two poses 396 times, by '
        '0.99 (metres and radians together), as two publishers do that send every 100 ms and '
        'every 100 ms; 20.0 Hz in all | count=396 samples=400 apart_m=0.99 rate_hz=20.0301']
    assert said('two_publishers', driving('odom base')) == []
    # Known by the numbers of its messages, it is reported once.
    known = refused(Kind.TWO_PUBLISHERS, 'odom', 'base', 2, 'one of /x, /y', 'two publishers')
    assert said('two_publishers', alternating('odom base'), driving('base arm'), driving(
        'arm tool'), incidents=[known]) == [
        'error odom>base | one of /x, /y | odom -> base: two publishers | count=2']


def test_all_edges_with_two_publishers_are_two_robots():
    edges = 'map odom', 'odom base', 'base arm'
    assert said('two_publishers', *[alternating(edge, node='/x') for edge in edges]) == [
        'error map>odom, odom>base, base>arm | /x | all 3 edges that move have two publishers, '
        'such as map -> odom: two robots with the same frame names send on one topic | edges=3 | '
        'cause: two robots or simulations share a ROS_DOMAIN_ID and a network; or a recording is '
        'played beside the robot; or everything was launched twice | fix: give each robot a '
        'ROS_DOMAIN_ID, or a namespace for /tf and a prefix for its frames; stop what was '
        'started twice']
    assert short('two_publishers', *[alternating(edge) for edge in edges[1:]]) == [
        'error odom>base',
        'error base>arm']
    assert short('two_publishers', *map(alternating, edges), driving('arm tool')) == [
        'error map>odom',
        'error odom>base',
        'error base>arm']
    still = sent('arm tool', TEN_HZ)
    known = [refused(Kind.TWO_PUBLISHERS, 'map', 'odom'), refused(Kind.TWO_PUBLISHERS, 'x', 'y')]
    assert short('two_publishers', alternating('odom base'), alternating('base arm'), driving(
        'map odom'), still, incidents=known) == [
        'error odom>base, base>arm, map>odom']


def test_edges_that_alternated_once_were_recorded_twice():
    shortly = alternating('odom base', 400, begin=100, end=130), alternating(
        'base arm', 400, begin=100, end=130)
    assert short('two_publishers', *shortly) == []
    assert short('clock_step', *shortly) == [
        'warning odom>base, base>arm']
    assert short('two_publishers', shortly[0], driving('base arm', 400)) == [
        'error odom>base']
    assert short('two_publishers', *shortly, alternating('arm tool', 400)) == [
        'error odom>base, base>arm, arm>tool']


def set_back(edges, begin=0.0, end=0.0):
    """
    Return messages of an edge whose arrivals go back from 10 s to 7 s.

    :param begin: from this stamp on, seconds, to the end, another publisher sends it, too.
    """
    stamps = every(0.1, 200)
    other = stamps[(stamps >= from_seconds(begin)) & (stamps < from_seconds(end))]
    return sum((sent(edges, each, each - from_seconds(3.0) * (each >= from_seconds(10.0)), poses(
        len(each), x=apart + 1e-9 * each)) for each, apart in (
            (stamps, 0.0), (other + from_seconds(0.04), 8.0))), [])


def test_edge_that_alternates_while_the_clock_of_the_arrivals_ran_twice():
    assert short('recorder_clock', set_back('odom base')) == [
        'warning odom>base']
    assert short('two_publishers', set_back('odom base')) == []
    # Alternating from a second before these 3 s to a second after them is no other publisher.
    assert short('recorder_clock', set_back('odom base', 6.2, 13.6)) == [
        'warning odom>base']
    assert short('two_publishers', driving('base arm'), driving('x y')) == []
    assert [short('two_publishers', set_back('odom base', begin, end)) for begin, end in (
        (6.2, 13.6), (5.0, 13.6), (6.2, 15.0))] == [[], ['error odom>base'], ['error odom>base']]


# --- quality of service

def endpoint(publishes, reliable, transient_local, node='/x', static=False):
    return Endpoint('/tf_static' if static else '/tf', static, node, publishes, reliable,
                    transient_local)


def with_endpoints(*endpoints):
    doctor = Doctor()
    doctor.endpoints = endpoints
    return doctor


def test_late_joiners_do_not_receive_a_volatile_static_publisher():
    edges = [fixed('map base', node='/x'), fixed('base arm', node='one of /x, /y'),
             fixed('arm tool', node='/z'), driving('map odom')]
    volatile = endpoint(True, True, False, static=True)
    assert said('late_joiner', *edges, doctor=with_endpoints(volatile)) == [
        'error (map base) | /x | /x publishes /tf_static as volatile, with map -> base: '
        'listeners of tf2 do not receive it | publishers=1 edges=1']
    unknown = endpoint(True, True, False, '', static=True)
    assert said('late_joiner', *edges, doctor=with_endpoints(unknown)) == [
        'error (map base arm tool) | an unknown node publishes /tf_static as volatile, with map '
        '-> base, base -> arm, arm -> tool: listeners of tf2 do not receive it | publishers=1 '
        'edges=3']
    assert said('late_joiner', doctor=with_endpoints(volatile)) == [
        'error () | /x | /x publishes /tf_static as volatile: listeners of tf2 do not receive it '
        '| publishers=1 edges=0']
    assert said('late_joiner', *edges, doctor=with_endpoints(
        endpoint(True, True, True, static=True), endpoint(True, True, False),
        endpoint(False, True, False, static=True))) == []


def test_publishers_that_do_not_match():
    def found(*endpoints):
        return said('qos_mismatch', doctor=with_endpoints(*endpoints))

    best_effort = endpoint(True, False, False)
    assert found(best_effort) == [
        'error () | /x | /x publishes /tf as best effort and volatile | deaf=0']
    assert found(best_effort, endpoint(False, True, False, '/rviz')) == [
        'error () | /x, /rviz | /x publishes /tf as best effort and volatile, and 1 subscription '
        'does not receive it | deaf=1']
    assert found(best_effort, endpoint(False, True, False, '/rviz'),
                 endpoint(False, True, False, '/nav'), endpoint(True, True, False, '/y'),
                 endpoint(False, False, False, '/z'),
                 endpoint(False, True, True, '/static', True)) == [
        'error () | /x, /rviz, /nav | /x publishes /tf as best effort and volatile, and 2 '
        'subscriptions do not receive it | deaf=2']
    assert found(endpoint(True, True, False), endpoint(False, True, True, '')) == [
        'error () | /x | /x publishes /tf reliably and volatile, and 1 subscription does not '
        'receive it | deaf=1']
    assert found(endpoint(True, True, True), endpoint(False, True, True)) == []
    assert found(endpoint(True, False, True, '', True)) == [
        'error () | an unknown node publishes /tf_static as best effort | deaf=0']
    assert found(endpoint(True, False, False, '', True), endpoint(False, True, True)) == []


def test_publisher_and_subscription_match_as_in_dds():
    for theirs, ours in product(product((False, True), repeat=2), repeat=2):
        one, other = endpoint(True, *theirs), endpoint(False, *ours)
        found = said('qos_mismatch', doctor=with_endpoints(one, other))
        matches = all(has or not wants for has, wants in zip(theirs, ours, strict=True))
        assert len(found) == (not matches or not theirs[0]), (theirs, ours)


# --- sources

def test_sources_that_were_replaced():
    incidents = [refused(Kind.SOURCE_SILENT, 'odom', 'base', 2, '/fusion', 'gps is silent'),
                 refused(Kind.SOURCE_DIVERGED, 'map', 'odom', 1, '/fusion', 'slam is off')]
    assert said('source_silent', incidents=incidents) == [
        'warning odom>base | /fusion | odom -> base changed its source twice: gps is silent | '
        'count=2']
    assert said('source_diverged', incidents=incidents) == [
        'warning map>odom | /fusion | map -> odom changed its source once: slam is off | count=1']


# --- the tree

def changing(pattern, period=0.5, parents=('a', 'b'), child='c'):
    """Return messages of a child, each with the parent of this place."""
    stamps = every(period, len(pattern))
    return sum((sent(f'{parents[place]} {child}', stamps[number:number + 1], node=f'/{place}')
                for number, place in enumerate(pattern)), [])


def test_child_that_alternates_between_two_parents():
    assert said('two_parents', changing([0, 1, 0, 1])) == [
        'error a>c, b>c | /0, /1 | c has the parents a, b, and changed between them 3 times | '
        'parents=2 switches=3']
    assert [short('two_parents', changing(pattern)) for pattern in (
        [0, 1, 0], [0, 1, 0, 1], [0, 0, 0, 0])] == [[], ['error a>c, b>c'], []]
    # Parents that change once a second or more seldom take turns.
    assert [short('two_parents', changing([0, 1] * 3, period))
            for period in (0.99, 1.0, 1.01)] == [['error a>c, b>c'], [], []]
    # The slower one of two is followed by the other again, each time.
    seldom = [1, *[0] * 9] * 5
    assert [short('two_parents', changing(pattern, 0.3)) for pattern in (
        seldom, [0] * 10 + [1] * 10 + [0] * 10 + [1] * 10)] == [['error b>c, a>c'], []]
    assert short('two_parents', changing([0] * 20 + [1, 0, 1] + [0] * 20, 5.0)) == [
        'error a>c, b>c']
    # As often as the other one comes, or as it comes itself, is no turn each time.
    assert [short('two_parents', changing(pattern, 5.0)) for pattern in (
        [0, 0, 1, 0, 0, 1, 0, 1, 0], [0, 0, 1, 0, 0, 1, 0, 0, 1, 0],
        [0] * 5 + [1, 1] + [0] * 5 + [1], [0] * 5 + [1] + [0] * 5 + [1])] == [
        [], ['error a>c, b>c'], [], ['error a>c, b>c']]


def test_child_with_a_static_parent_and_another_one():
    assert said('two_parents', fixed('a c', node='/urdf'), fixed('b c', node='/x')) == [
        'error a>c, b>c | /urdf, /x | c has the parents a, b, and changed between them once | '
        'parents=2 switches=1']
    assert short('two_parents', fixed('a c'), sent('b c', TEN_HZ)) == [
        'error a>c, b>c']
    assert short('two_parents', sent('a c', every(0.1, 3)), sent('b c', every(0.1, 3, 1.0))) == []
    assert short('two_parents', fixed('a c'), fixed('a d')) == []


def test_frame_that_was_given_to_another():
    assert said('two_parents', incidents=[refused(
        Kind.NOT_ITS_OWN, 'map', 'robot1/base', 2, '/robot2', 'of another')]) == [
        'warning map>robot1/base | /robot2 | robot1/base was given the parent map, and that was '
        'refused twice: of another | count=2 | cause: a robot of a fleet publishes a frame that '
        'all robots share | fix: do not publish that edge on the robot']


def test_trees_that_are_not_connected():
    assert said('unconnected', fixed('map odom, odom base', node='/a'), fixed(
        'rack shelf', node='/b'), fixed('table plate, plate cup, table fork', node='/c')) == [
        'error (table map) | /a | map and 2 more frames are not connected with table and 3 more '
        'frames | trees=3 frames=3',
        'error (table rack) | /b | rack and 1 more frames are not connected with table and 3 '
        'more frames | trees=3 frames=2']
    assert said('unconnected', fixed('map odom, odom base'), fixed('rack ODOM')) == []
    assert said('unconnected', fixed('map odom, odom base')) == []
    assert said('unconnected') == []
    assert said('unconnected', fixed('one/map one/base, one/base one/arm'),
                fixed('two/map two/base'), doctor=Doctor(recorded=True)) == [
        'note (one/map two/map) | two/map and 1 more frames are not connected with one/map and 2 '
        'more frames | trees=2 frames=2 | fix: no lookup from one tree to the other works in '
        'this recording. Find out which node publishes an edge between the two roots, and start '
        'it before the next']
    assert said('unconnected', sent('a c', TEN_HZ, node='/a'), sent('b c', TEN_HZ, node='/b'),
                fixed('x y')) == [
        'error (a b x) | x and 1 more frames are not connected with a and 2 more frames | '
        'trees=2 frames=2']
    assert examined(fixed('x y')).transforms == 1
