# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parent of a frame at a stamp, and the samples that determine it."""

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import InvalidArgumentException, Pose


@pytest.fixture
def buffer():
    buffer = BufferCore()
    buffer.insert('base', 'camera', 0, Pose(z=1.0), static=True)
    for stamp in (100, 200):
        buffer.insert('map', 'base', stamp, Pose(x=float(stamp)))
    for stamp in (300, 400):
        buffer.insert('odom', 'base', stamp, Pose(x=float(stamp)), strict=False)
    return buffer


@pytest.mark.parametrize(('stamp', 'parents'), [
    (99, {'camera': 'base'}),
    (150, {'base': 'map', 'camera': 'base'}),
    (350, {'base': 'odom', 'camera': 'base'}),
    (401, {'camera': 'base'}),
])
def test_parent_is_the_one_of_that_stamp(buffer, stamp, parents):
    assert buffer.parents_at(stamp) == parents


def test_parents_at_wants_a_stamp(buffer):
    with pytest.raises(InvalidArgumentException):
        buffer.parents_at(1.5)


def test_stamps_are_those_of_the_samples(buffer):
    np.testing.assert_array_equal(buffer.stamps_of('base'), [100, 200, 300, 400])


@pytest.mark.parametrize('frame', ['camera', 'map', 'nobody'])
def test_what_does_not_move_has_no_stamps(buffer, frame):
    assert len(buffer.stamps_of(frame)) == 0


def test_what_was_forgotten_has_no_stamps(buffer):
    buffer.clear()
    assert len(buffer.stamps_of('base')) == 0
    assert buffer.parents_at(150) == {'camera': 'base'}
