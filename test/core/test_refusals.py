# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A refusal is always reported to a program that inserts directly."""

import copy
import pickle
import warnings

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    Kind,
    Pose,
    RefusedException,
    Sample,
    TransformException,
    TransformWarning,
    UNLIMITED,
)

SECOND = 10**9
NAN = Pose(float('nan'))

INSERTIONS = {
    'insert': lambda buffer, *sample, **options: buffer.insert(*sample, **options),
    'insert_many': lambda buffer, *sample, **options: buffer.insert_many(
        [Sample(*sample)], **options),
    'insert_track': lambda buffer, parent, child, stamp, pose, **options: buffer.insert_track(
        parent, child, [stamp], [pose], **options),
}
insertions = pytest.mark.parametrize('insert', INSERTIONS.values(), ids=INSERTIONS)


@pytest.fixture
def warned():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        yield caught


@insertions
def test_first_of_each_kind_is_warned_of(warned, insert):
    buffer = BufferCore()
    for number in range(3):
        assert insert(buffer, 'map', 'base', number, NAN)
        assert insert(buffer, 'map', '', number, Pose())
    assert [warning.category for warning in warned] == [TransformWarning] * 2
    text = str(warned[0].message)
    assert text.startswith("Refused transform 'map' -> 'base' from 'default_authority' (NaN")
    assert 'Pass strict=True to raise' in text
    insert(BufferCore(), 'map', 'base', 1, NAN)
    assert len(warned) == 3


@insertions
def test_warning_names_the_line_that_inserts(warned, insert):
    insert(BufferCore(), 'map', 'base', 1, NAN)
    assert warned[0].filename == __file__


def test_remark_is_warned_of_and_not_raised(warned):
    buffer = BufferCore()
    buffer.insert('map', 'base', 1, Pose(), authority='one', strict=True)
    remark, = buffer.insert('odom', 'base', 2, Pose(), authority='other', strict=True)
    assert remark.kind is Kind.SECOND_PARENT
    assert str(warned[0].message).startswith("Note on transform 'odom' -> 'base' from 'other'")


@insertions
def test_strict_raises_what_is_refused(warned, insert):
    buffer = BufferCore()
    assert insert(buffer, 'map', 'base', 1, Pose(), strict=True) == []
    with pytest.raises(RefusedException, match=r'^Refused transform .* \(NaN or inf') as raised:
        insert(buffer, 'map', 'base', 2, NAN, strict=True)
    assert isinstance(raised.value, TransformException)
    assert [incident.kind for incident in raised.value.incidents] == [Kind.NOT_FINITE]
    for twin in (copy.copy(raised.value), pickle.loads(pickle.dumps(raised.value))):
        assert twin.incidents == raised.value.incidents
        assert str(twin) == str(raised.value)
    assert not warned


def test_strict_takes_all_that_is_good():
    buffer = BufferCore()
    with pytest.raises(RefusedException, match=r'\(2 were refused\)') as raised:
        buffer.insert_track('map', 'base', range(4), [Pose(), NAN, NAN, Pose()], strict=True)
    assert len(raised.value.incidents) == 2
    assert buffer.edges()[0].samples == 2
    assert buffer.statistics().accepted == 2


@insertions
def test_who_looks_at_what_is_returned_is_not_warned(warned, insert):
    assert insert(BufferCore(), 'map', 'base', 1, NAN, strict=False)[0].kind is Kind.NOT_FINITE
    assert not warned


def test_samples_that_the_buffer_does_not_keep_are_warned_of(warned):
    stamps = np.arange(0, 60 * SECOND, SECOND)
    track = 'map', 'base', stamps, [Pose()] * 60
    BufferCore(UNLIMITED).insert_track(*track)
    BufferCore().insert_track(*track, strict=False)
    assert not warned
    buffer = BufferCore()
    assert buffer.insert_track(*track) == []
    assert [(str(warning.message), warning.filename) for warning in warned] == [(
        "Samples of 'map' -> 'base' span 59.000 s, and the buffer keeps 10.000 s: older samples "
        'were dropped. cache_time=UNLIMITED keeps everything', __file__)]


def test_what_a_listener_hears_is_not_warned_of(warned):
    from tf_tree_py.core.edges.packed import pack_pose
    from tf_tree_py.core.messages.sample import Batch
    batch = Batch((('map', 'base'),), [1], [pack_pose(*NAN)])
    assert BufferCore().insert_batch(batch)[0].kind is Kind.NOT_FINITE
    assert not warned
