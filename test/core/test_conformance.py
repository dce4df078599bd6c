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

"""The answers of the core are those that tf2's C++ buffer was recorded to give."""

import pytest
from recordings import problems_of, RECORDINGS, Replay
from tf_tree_py.core.geometry.so3 import with_tf2_sign


class CoreReplay(Replay):
    """The core has no favourite sign; messages get tf2's by this function."""

    def run_lookup(self, operation):
        return signed(super().run_lookup(operation))

    def run_lookup_full(self, operation):
        return signed(super().run_lookup_full(operation))


def signed(answer):
    stamp, pose = answer
    return stamp, (*pose[:3], *with_tf2_sign(pose[3:]))


@pytest.mark.parametrize('recording', RECORDINGS, ids=lambda path: path.stem)
def test_answers_are_those_of_tf2(recording):
    answers, problems = problems_of(CoreReplay(), recording)
    assert answers > 0
    assert not problems, f'{len(problems)} of {answers} differ\n' + '\n'.join(problems[:5])


def test_every_family_is_replayed():
    assert len(RECORDINGS) == 14
