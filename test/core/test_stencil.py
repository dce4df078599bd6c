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

"""Messages by a stencil are those that are written anew."""

from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import random_poses
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.stencil import Stencil
from tf_tree_py.core.arrivals.wire import write

names = st.text(max_size=9)


@given(st.lists(st.tuples(names, names), max_size=6),
       st.lists(st.integers(-2**31 * 10**9, 2**31 * 10**9), min_size=1, max_size=3))
def test_message_is_that_which_is_written(edges, stamps):
    stencil = Stencil(edges)
    for number, stamp in enumerate(stamps):
        poses = random_poses(np.random.default_rng(number), len(edges))
        assert stencil.fill(stamp, poses) == write([
            Sample(*edge, stamp, pose) for edge, pose in zip(edges, poses.tolist(), strict=True)])


def test_stamp_that_no_message_holds_is_refused():
    with pytest.raises(InvalidArgumentException, match='no message can hold it'):
        Stencil([('a', 'b')]).fill(2**62, np.zeros((1, 7)))
