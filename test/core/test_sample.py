# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math

from hypothesis import example, given, strategies as st
from inputs import for_each
from memory import bytes_of
import numpy as np
import pytest
from strategies import about, assert_same_rotation, axes, components
from tf_tree_py import BufferCore
from tf_tree_py.core import Incident, InvalidArgumentException, Kind, Pose, Sample
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.geometry.poses import is_sound, judged
from tf_tree_py.core.messages.sample import admitted, Batch, checked, Edges

SOUND = Sample('parent', 'child', 7, (1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8))


def check(parent='parent', child='child', pose=SOUND.pose):
    return checked(admitted(Sample(parent, child, 7, pose)), 'somebody')


def test_sound_sample_is_taken_as_it_is():
    assert checked(SOUND, 'somebody') == SOUND


@pytest.mark.parametrize(('name', 'kept'), [
    ('base', 'base'), ('/base', 'base'), ('//base', '/base'), ('base/', 'base/'),
    ('/robot1/base', 'robot1/base'), ('a b', 'a b'), ('gr\u00fcn', 'gr\u00fcn'),
])
def test_exactly_one_leading_slash_is_stripped(name, kept):
    assert check(parent=name).parent == kept
    assert check(child=name).child == kept


def test_name_that_is_no_string_is_told():
    for names in ((None, 'child'), ('parent', 5), (b'parent', 'child')):
        with pytest.raises(InvalidArgumentException, match='must be strings'):
            check(*names)


@pytest.mark.parametrize(('parent', 'child', 'kind', 'detail'), [
    ('', 'child', Kind.EMPTY_FRAME, 'header.frame_id is not set'),
    ('parent', '', Kind.EMPTY_FRAME, 'child_frame_id is not set'),
    ('/', 'child', Kind.EMPTY_FRAME, 'header.frame_id is not set'),
    ('parent', '/', Kind.EMPTY_FRAME, 'child_frame_id is not set'),
    ('same', 'same', Kind.SELF_EDGE, 'are the same'),
    ('/same', 'same', Kind.SELF_EDGE, 'are the same'),
])
def test_names_that_make_no_edge_are_refused(parent, child, kind, detail):
    incident = check(parent, child)
    assert isinstance(incident, Incident)
    assert incident.kind is kind
    assert detail in incident.detail
    assert (incident.authority, incident.stamp) == ('somebody', 7)


@pytest.mark.filterwarnings('error')
@for_each(place=range(7), bad=[math.nan, math.inf, -math.inf])
def test_nan_and_infinity_are_refused_anywhere(place, bad):
    pose = (*SOUND.pose[:place], bad, *SOUND.pose[place + 1:])
    assert check(pose=pose).kind is Kind.NOT_FINITE
    assert not is_sound(pose)
    assert judged(np.array([SOUND.pose, pose]))[1].tolist() == [True, False]


@pytest.mark.filterwarnings('error')
def test_infinities_that_cancel_are_refused_too():
    pose = (math.inf, -math.inf, 0.0, *SOUND.pose[3:])
    assert check(pose=pose).kind is Kind.NOT_FINITE
    assert not judged(np.array([pose]))[1].any()


def test_all_zero_quaternion_is_refused():
    incident = check(pose=(1.0, 2.0, 3.0, 0.0, -0.0, 0.0, 0.0))
    assert incident.kind is Kind.ZERO_ROTATION
    assert 'To send no rotation, set it to 0 0 0 1' in incident.detail


def test_quaternion_too_long_to_measure_is_refused():
    assert check(pose=(0.0, 0.0, 0.0, 1e308, 1e308, 1e308, 1e308)).kind is Kind.NOT_FINITE


@given(axes, components, st.floats(-300.0, 300.0))
def test_any_other_quaternion_is_normalised(axis, angle, power):
    q = about(axis, angle)
    scaled = tuple(10.0 ** power * value for value in q)
    sample = check(pose=(1.0, 2.0, 3.0, *scaled))
    assert sample.pose[:3] == (1.0, 2.0, 3.0)
    assert math.hypot(*sample.pose[3:]) == pytest.approx(1.0, abs=1e-12)
    assert_same_rotation(sample.pose[3:], q, 1e-14)


def test_small_error_of_a_float32_quaternion_is_normalised_away():
    q = np.array([0.1, 0.2, 0.3, math.sqrt(0.86)], dtype=np.float32).astype(float).tolist()
    assert math.hypot(*check(pose=(0.0, 0.0, 0.0, *q)).pose[3:]) == pytest.approx(1.0, abs=1e-15)


def test_largest_translation_is_taken():
    pose = (1e308, 1e308, -1e308, 0.0, 0.0, 0.0, 1.0)
    assert check(pose=pose).pose == pose


# --- a whole message at once


numbers = st.sampled_from([
    0.0, -0.0, 1.0, 0.5, 2.0, 1e-160, 1e-308, 1e160, 1e308, math.nan, math.inf, -math.inf])
any_poses = st.one_of(
    st.tuples(*[numbers] * 7),
    st.builds(lambda axis, angle, size: (1.0, 2.0, 3.0, *(size * x for x in about(axis, angle))),
              axes, components, st.sampled_from([1.0, 1.0 + 1e-13, 1.0 + 1e-7, 3.0])))


@given(st.lists(any_poses, max_size=4))
@example([(0.0, 0.0, 0.0, 1e-160, 2e-160, 3e-160, 4e-160)])
def test_many_poses_are_judged_and_normalised_as_each_is(poses):
    each = [check(pose=pose) for pose in poses]
    many, good = judged(np.reshape(np.array(poses, dtype=float), (-1, 7)))
    assert good.tolist() == [isinstance(sample, Sample) for sample in each]
    for sample, pose, given_pose in zip(each, many.tolist(), poses, strict=True):
        expected = sample.pose if isinstance(sample, Sample) else given_pose
        assert pose == pytest.approx(expected, rel=1e-12, abs=1e-12, nan_ok=True)


names = st.sampled_from(['a', 'b', 'c', 'd', ''])
# Some have more poses than are checked one by one.
messages = st.lists(st.tuples(names, names, st.integers(0, 30), any_poses), max_size=9)


@pytest.mark.filterwarnings('error', 'ignore:cache_time=:UserWarning')
@given(st.lists(st.tuples(messages, st.sampled_from(['one', 'other']), st.booleans()), max_size=8))
def test_batch_is_its_samples_one_after_the_other(arrivals):
    whole, single = BufferCore(10), BufferCore(10)
    layouts = {}
    for message, authority, static in arrivals:
        edges = tuple((parent, child) for parent, child, _, _ in message)
        batch = Batch(layouts.setdefault(edges, Edges(edges)),
                      [stamp for _, _, stamp, _ in message],
                      [pack_pose(*pose) for *_, pose in message])
        told = whole.insert_batch(batch, authority, static)
        expected = [incident for sample in batch.samples()
                    for incident in single.insert_many(
                        [sample], authority, static, strict=False)]
        assert list(map(str, told)) == list(map(str, expected))
    assert whole.frames() == single.frames()
    assert whole.edges() == single.edges()
    assert whole.statistics() == single.statistics()
    for _, child, *_ in whole.edges():
        for target in whole.frames():
            expected = pytest.approx(answer(single, target, child), nan_ok=True)
            assert answer(whole, target, child) == expected


def test_batch_that_names_a_child_twice_is_taken_in_its_order():
    edges = (('gripper', 'box'), ('table', 'box'))
    buffer = BufferCore()
    buffer.insert('table', 'box', 1, Pose())
    buffer.insert_batch(Batch(edges, [2, 2], [pack_pose(*Pose())] * 2))
    (edge,) = buffer.edges()
    assert (edge.parent, edge.child, edge.samples) == ('table', 'box', 3)
    assert buffer.statistics().accepted == 3


def test_batch_goes_on_after_one_that_needs_a_closer_look():
    edges = (('a', 'a'), ('a', 'b'), ('new', 'a'), ('b', 'c'))
    buffer = BufferCore()
    for parent, child in ('ab', 'bc'):
        buffer.insert(parent, child, 1, Pose())
    (incident,) = buffer.insert_batch(Batch(edges, [2] * 4, [pack_pose(*Pose(5.0))] * 4))
    assert incident.kind is Kind.SELF_EDGE
    assert {edge.child: (edge.samples, edge.latest) for edge in buffer.edges()} == {
        'b': (2, 2), 'a': (1, 2), 'c': (2, 2)}
    assert buffer.lookup('new', 'c') == Pose(15.0)


@pytest.mark.parametrize('change', [
    lambda buffer: buffer.insert('a', 'b', 0, Pose(7.0), static=True),
    lambda buffer: buffer.remove_frame('b'),
    lambda buffer: buffer.clear(),
    lambda buffer: buffer.insert('c', 'b', 4, Pose(7.0)),
], ids=['made static', 'removed', 'cleared', 'hung elsewhere'])
def test_messages_of_one_kind_go_on_after_their_edge_has_changed(change):
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, Pose(1.0))
    edges = Edges([('a', 'b')])

    def arrive(stamp):
        buffer.insert_batch(Batch(edges, [stamp], [pack_pose(*Pose(float(stamp)))]))

    arrive(2)
    arrive(3)
    change(buffer)
    arrive(4)
    arrive(5)
    assert buffer.lookup('a', 'b', 5) == Pose(5.0)
    assert buffer.lookup('a', 'b', 4) == Pose(4.0)
    assert buffer.edges()[0].latest == 5


def test_list_of_edges_may_be_reused_for_others():
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, Pose())
    buffer.insert('a', 'c', 1, Pose())
    edges = [('a', 'b')]
    buffer.insert_batch(Batch(edges, [2], [pack_pose(*Pose(2.0))]))
    edges[0] = ('a', 'c')
    buffer.insert_batch(Batch(edges, [3], [pack_pose(*Pose(3.0))]))
    assert {edge.child: edge.latest for edge in buffer.edges()} == {'b': 2, 'c': 3}


def answer(buffer, target, source):
    try:
        return buffer.lookup(target, source)
    except Exception as error:
        return type(error)


def test_edges_of_ever_new_messages_are_not_kept_for_ever():
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, Pose())
    names = ['a', 'b']
    for stamp in range(2, 2000):
        edges = Edges([tuple(names)])  # equal to the last ones, but another object
        assert not buffer.insert_batch(Batch(edges, [stamp], [pack_pose(*Pose())]))
    assert buffer.statistics().accepted == 1999
    samples = bytes_of(buffer.intake.tree.histories)
    assert bytes_of(buffer) - samples < 200_000
