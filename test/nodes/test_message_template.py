# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages from a template equal those that are serialized from scratch."""

from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import random_poses
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.nodes.robot_frames import MessageTemplate

names = st.text(max_size=9)


@given(st.lists(st.tuples(names, names), max_size=6),
       st.lists(st.integers(-2**31 * 10**9, 2**31 * 10**9), min_size=1, max_size=3))
def test_message_is_that_which_is_written(edges, stamps):
    stencil = MessageTemplate(edges)
    for number, stamp in enumerate(stamps):
        poses = random_poses(np.random.default_rng(number), len(edges))
        assert stencil.fill(stamp, poses) == write([
            Sample(*edge, stamp, pose) for edge, pose in zip(edges, poses.tolist(), strict=True)])


def test_stamp_that_no_message_holds_is_refused():
    with pytest.raises(InvalidArgumentException, match='no message can hold it'):
        MessageTemplate([('a', 'b')]).fill(2**62, np.zeros((1, 7)))
