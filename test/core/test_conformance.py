# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The results of the core equal the recorded results of tf2's C++ buffer."""

import json
from pathlib import Path

import pytest
from recordings import problems_of, RECORDINGS, Replay
from tf_tree_py import BufferCore
from tf_tree_py.core.geometry.so3 import with_tf2_sign


@pytest.mark.parametrize('recording', RECORDINGS, ids=lambda path: path.stem)
def test_answers_are_those_of_tf2(recording):
    answers, problems = problems_of(Replay(BufferCore, with_tf2_sign), recording)
    assert answers > 0
    assert not problems, f'{len(problems)} of {answers} differ\n' + '\n'.join(problems[:5])


def test_every_family_is_replayed():
    assert len(RECORDINGS) == 14


def test_page_of_deviations_counts_the_recorded_answers():
    operations = [json.loads(line) for recording in RECORDINGS
                  for line in recording.read_text().splitlines()]
    answers = sum('error' in operation or 'result' in operation for operation in operations)
    page = Path(__file__).parents[2] / 'docs' / 'deviations.md'
    assert f'replays {answers:,} recorded' in page.read_text()
