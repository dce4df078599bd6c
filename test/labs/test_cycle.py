# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A loop: the recorded results of the real tf2 for every pair, and this tree's results."""

from lab_reports import report_of, rows_of
import numpy as np
import pytest
from tf_tree_py.core import Kind
from tf_tree_py.labs.cycle import disputed, FRAMES, publish, tf2_lookup, TooDeep

# The recorded results of tf2's own BufferCore (tf2_py 0.7) with the same data: x in metres; rows
# are target frames, columns source frames; None is LookupException "... contains a loop".
RECORDED = {
    'odom': (0.0, 2.0, 2.1, 2.3, 0.5),
    'base_link': (-2.3, 0.0, 0.1, 0.3, -1.8),
    'torso': (None, None, 0.0, 0.2, None),
    'camera': (None, None, None, 0.0, None),
    'dock': (None, None, None, None, 0.0),
}


@pytest.mark.parametrize('target', FRAMES)
def test_model_of_tf2_says_what_tf2_said(target):
    for source, x in zip(FRAMES, RECORDED[target], strict=True):
        if x is None:
            with pytest.raises(TooDeep):
                tf2_lookup(disputed(), target, source)
        else:
            assert tf2_lookup(disputed(), target, source).x == pytest.approx(x)


def test_model_of_tf2_is_right_on_a_tree():
    tree = disputed()
    del tree['odom']
    buffer, _ = publish()
    for target in FRAMES:
        for source in FRAMES:
            assert np.allclose(tf2_lookup(tree, target, source).as_matrix(),
                               buffer.lookup(target, source).as_matrix())


def test_this_tree_refuses_the_edge_and_names_the_loop_and_both_nodes():
    _, incidents = publish()
    [incident] = incidents
    assert incident.kind is Kind.LOOP and incident.refused
    for part in ('odom -> base_link -> odom', '/ekf', '/wheel_odometry'):
        assert part in str(incident)


def test_this_tree_answers_every_pair_and_both_ways_agree():
    numbers = report_of('cycle').numbers
    assert (numbers['pairs'], numbers['tf2_failed'], numbers['here_failed']) == (20, 11, 0)
    x = {(row['target'], row['source']): row['here_x_m'] for row in rows_of('cycle')}
    assert all(x[pair] == pytest.approx(-x[pair[::-1]]) for pair in x)
    assert numbers['tf2_there_m'] != -numbers['tf2_back_m']
