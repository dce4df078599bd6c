# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The insertions that skip the closer checks, verified by counting calls.

A message whose names are known is parsed at once. A sample that just follows the last one of
its edge is appended, together with its message. Other samples are inserted one by one, and odd
ones are checked closely, which takes several times as long. The results would not show it if
the usual case took the slow way.
"""

from counting import calls
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core.messages import message_layout, sample
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import WireReader, write
from tf_tree_py.core.tree.tree import Tree

SECOND = 10**9
POSE = (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)
EDGES = (('map', 'odom'), ('odom', 'base'), ('base', 'camera'))
# More than are checked one by one.
MANY = tuple((f'link{number}', f'link{number + 1}') for number in range(12))

FIELD_BY_FIELD = message_layout.find_layout
ONE_BY_ONE = Tree.append
CLOSER_LOOK = sample.checked


class Stream:
    """The messages of one publisher, and the buffer that receives them."""

    def __init__(self):
        self.buffer = BufferCore()
        self.reader = WireReader()

    def send(self, seconds, edges=EDGES, pose=POSE, static=False, convert=bytes):
        """
        Read and insert one message.

        :param pose: one for all edges, or a list with one for each.
        :return: how many messages were parsed field by field, how many samples were inserted one
            by one, how many were checked closely, and how many were accepted.
        """
        poses = pose if isinstance(pose, list) else [pose] * len(edges)
        data = convert(write([Sample(*edge, round(seconds * SECOND), pose)
                              for edge, pose in zip(edges, poses, strict=True)]))
        before = self.buffer.statistics().accepted
        with calls() as of:
            self.buffer.insert_batch(self.reader.read(data), 'me', static)
        return (of(FIELD_BY_FIELD), of(ONE_BY_ONE), of(CLOSER_LOOK),
                self.buffer.statistics().accepted - before)


@pytest.fixture
def stream():
    return Stream()


def big_endian(data):
    """Return a message with the bytes of every number reversed; its edges are EDGES or MANY."""
    swapped = bytearray(data)
    swapped[:4] = b'\0\0\0\0'

    def swap(begin, size):
        swapped[begin:begin + size] = data[begin:begin + size][::-1]

    swap(4, 4)
    position = 8
    for _ in range(int.from_bytes(data[4:8], 'little')):
        position += -(position - 4) % 4
        swap(position, 4)
        swap(position + 4, 4)
        position += 8
        for _ in range(2):
            position += -(position - 4) % 4
            swap(position, 4)
            position += 4 + int.from_bytes(data[position:position + 4], 'little')
        position += -(position - 4) % 8
        for _ in range(7):
            swap(position, 8)
            position += 8
    return bytes(swapped)


def scaled(factor):
    return (*POSE[:3], *(factor * value for value in POSE[3:]))


# The norm of a quaternion after rounding in float64, and from a publisher with float32.
ROUNDED, ROUGH = scaled(1.0 + 1e-14), scaled(1.0 + 1e-7)
SLASHES = tuple((f'/{parent}', f'/{child}') for parent, child in EDGES)


@pytest.mark.parametrize(('edges', 'changed'), [
    (EDGES, {}),
    (MANY, {}),
    (SLASHES, {}),
    (EDGES, {'pose': ROUNDED}),
    (MANY, {'pose': ROUNDED}),
    (MANY, {'pose': ROUGH}),
    (EDGES, {'convert': big_endian}),
    (MANY, {'convert': big_endian}),
    ((), {}),
], ids=['few', 'many', 'leading_slashes', 'few_rounded', 'many_rounded', 'many_rough',
        'few_big_endian', 'many_big_endian', 'none'])
def test_next_message_of_known_edges_has_no_closer_look(stream, edges, changed):
    first = stream.send(1.0, edges, **changed)
    assert first == (1, len(edges), len(edges), len(edges))
    # Including twice at one stamp.
    for seconds in (2.0, 2.0, 3.0, 30.0):
        assert stream.send(seconds, edges, **changed) == (0, 0, 0, len(edges))


def test_message_of_other_names_is_read_field_by_field_once(stream):
    stream.send(1.0)
    assert stream.send(2.0, EDGES[1:]) == (1, 0, 0, 2)
    assert stream.send(3.0, EDGES) == (0, 0, 0, 3)
    assert stream.send(4.0, EDGES[1:]) == (0, 0, 0, 2)


def test_rough_quaternion_of_few_has_a_closer_look_alone(stream):
    stream.send(1.0)
    assert stream.send(2.0, pose=[POSE, ROUGH, POSE]) == (0, 3, 1, 3)


def test_late_message_has_a_closer_look_and_the_next_has_none(stream):
    stream.send(1.0)
    stream.send(2.0)
    assert stream.send(1.5) == (0, 3, 3, 3)
    assert stream.send(3.0) == (0, 0, 0, 3)


def test_sample_that_is_late_costs_nothing_to_those_beside_it(stream):
    stream.send(1.0)
    stream.send(5.0, EDGES[:1])
    assert stream.send(2.0) == (0, 3, 1, 3)


def test_new_edge_costs_nothing_to_those_beside_it(stream):
    stream.send(1.0)
    assert stream.send(2.0, (*EDGES, ('base', 'lidar'))) == (1, 1, 1, 4)
    assert stream.send(3.0, (*EDGES, ('base', 'lidar'))) == (0, 0, 0, 4)


@pytest.mark.parametrize('bad', [
    scaled(float('nan')), scaled(0.0), (float('inf'), *POSE[1:])], ids=['nan', 'zero', 'inf'])
@pytest.mark.parametrize('edges', [EDGES, MANY], ids=['few', 'many'])
def test_refused_transform_costs_nothing_to_those_beside_it(stream, edges, bad):
    stream.send(1.0, edges)
    poses = [POSE] * len(edges)
    poses[1] = bad
    assert stream.send(2.0, edges, poses) == (0, len(edges), 1, len(edges) - 1)
    assert stream.send(3.0, edges) == (0, 0, 0, len(edges))


def test_frame_that_is_hung_elsewhere_has_a_closer_look_from_then_on(stream):
    """Its history stores the parent of each sample; its neighbours are unchanged."""
    stream.send(1.0)
    elsewhere = (EDGES[0], ('map', 'base'), EDGES[2])
    assert stream.send(2.0, elsewhere) == (1, 2, 1, 3)
    assert stream.send(3.0, elsewhere) == (0, 2, 1, 3)
    assert stream.send(4.0) == (0, 2, 1, 3)


def test_edge_is_fast_again_when_its_old_parent_is_forgotten(stream):
    stream.send(1.0)
    elsewhere = (EDGES[0], ('map', 'base'), EDGES[2])
    # Twenty a second: expired samples are dropped in blocks.
    for number in range(40, 500):
        stream.send(number / 20.0, elsewhere)
    assert stream.send(25.0, elsewhere) == (0, 0, 0, 3)


def test_static_transforms_have_a_closer_look_each_time(stream):
    assert stream.send(1.0, static=True) == (1, 0, 3, 3)
    assert stream.send(2.0, static=True) == (0, 0, 3, 3)
    assert stream.send(3.0) == (0, 3, 3, 3)


def test_single_samples_go_the_same_way(stream):
    def insert(seconds, edge=EDGES[0], pose=POSE):
        with calls() as of:
            stream.buffer.insert(*edge, round(seconds * SECOND), pose)
        return of(CLOSER_LOOK)

    assert insert(1.0) == 1
    assert [insert(2.0), insert(2.0), insert(3.0, pose=ROUNDED)] == [0, 0, 0]
    assert insert(4.0, ('/map', '/odom')) == 0
    assert insert(5.0, pose=ROUGH) == 1
    assert insert(1.5) == 1
    assert insert(6.0, ('world', 'odom')) == 1
    assert insert(7.0) == 1
