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

"""What GitHub runs and asks: the files can be read, and what they name is there."""

from pathlib import Path
import re

import pytest

yaml = pytest.importorskip('yaml')

REPOSITORY = Path(__file__).resolve().parents[1]
FILES = sorted([*REPOSITORY.glob('.github/*/*.yml'), REPOSITORY / 'CITATION.cff'])


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_file_can_be_read_and_what_it_names_is_there(file):
    text = file.read_text()
    assert yaml.safe_load(text)
    for script in re.findall(r'(?:\./)?((?:scripts|\.ci|\.github)/[\w./-]+)', text):
        assert (REPOSITORY / script).is_file(), script


def test_all_is_tested_before_a_release():
    jobs = {file.stem: yaml.safe_load(file.read_text())['jobs']
            for file in FILES if file.parent.name == 'workflows'}
    for job in jobs['test'].values():
        assert any('.ci/run' in step.get('run', '') for step in job['steps'])
    assert jobs['release']['publish']['needs'] == 'build'
    assert jobs['release']['build']['needs'] == 'test'
    assert [name for name, job in jobs['release'].items()
            if 'id-token' in job.get('permissions', ())] == ['publish']
