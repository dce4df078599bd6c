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
