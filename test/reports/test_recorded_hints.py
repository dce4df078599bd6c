# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The hints of errors fit the tree: where no data can arrive, none speaks of waiting for it."""

from failing_lookups import BEGIN, END, error_of, FAILING, fill, OF_LIVE_TREES, SECOND
import numpy as np
import pytest
from tf_tree_py import BufferCore, load, Pose, Spline, UNLIMITED
from tf_tree_py.reports.explanation import explain


def live():
    return fill(BufferCore(UNLIMITED, now=lambda: END))


def loaded(folder):
    live().save(folder / 'run.tftree')
    return load(folder / 'run.tftree')


COMPLETE = {
    'buffer without a clock': lambda folder: fill(BufferCore(UNLIMITED)),
    'snapshot of a live buffer': lambda folder: live().snapshot(),
    'smoothed': lambda folder: live().smoothed(),
    'saved tree': loaded,
}


@pytest.mark.parametrize('made', COMPLETE.values(), ids=COMPLETE)
def test_no_error_of_a_tree_without_new_data_speaks_of_waiting(made, tmp_path):
    tree = made(tmp_path)
    said = {name: error_of(lookup, tree) for name, lookup in FAILING.items()}
    assert {name: text for name, text in said.items() if OF_LIVE_TREES.search(text)} == {}
    assert 'stamps_at_rate returns stamps for which all edges have data' in said['a bit newer']


def test_errors_of_a_live_buffer_suggest_a_timeout_or_what_to_check():
    buffer = live()
    assert 'Use a timeout' in error_of(FAILING['a bit newer'], buffer)
    assert 'Use a timeout' in error_of(FAILING['lookup_at'], buffer)
    assert 'Use a timeout' in error_of(FAILING['lookup_many'], buffer)
    assert 'Use a timeout' in error_of(FAILING['lookup_full'], buffer)
    assert 'Use a timeout' in error_of(FAILING['lookup_uncertain'], buffer)
    assert 'started later' in error_of(FAILING['a bit older'], buffer)
    assert 'which node should publish' in error_of(FAILING['two trees'], buffer)


@pytest.mark.parametrize('fails', [
    lambda buffer: buffer.lookup('map', 'base', BEGIN),
    lambda buffer: buffer.lookup('base', 'tip', END + 1),
    lambda buffer: BufferCore().lookup('map', 'base'),
], ids=['older than the window', 'after a curve', 'empty'])
def test_other_trees_without_new_data_do_not_speak_of_waiting_either(fails):
    buffer = fill(BufferCore(SECOND))
    stamps = np.arange(BEGIN, END + 1, SECOND // 10)
    buffer.insert_curve('base', 'tip', Spline.fit(stamps, [Pose()] * len(stamps), 5.0))
    assert not OF_LIVE_TREES.search(error_of(fails, buffer))
    buffer.clear()
    assert not OF_LIVE_TREES.search(error_of(lambda tree: tree.lookup('map', 'base'), buffer))


@pytest.mark.parametrize(('target', 'source', 'stamp'), [
    ('map', 'camera', END + 1), ('map', 'camera', END + 20 * SECOND), ('map', 'camera', BEGIN),
    ('map', 'tree', END), ('map', 'nowhere', END), ('pole', 'mast', BEGIN + 20 * SECOND)])
def test_explanation_does_not_speak_of_waiting_either(target, source, stamp):
    problem = explain(fill(BufferCore(UNLIMITED)), target, source, stamp, END).problem
    assert problem and not OF_LIVE_TREES.search(problem)
