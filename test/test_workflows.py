# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""GitHub's workflows and forms: the files are valid, and the paths that they name exist."""

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
    commands = {name: ' '.join(step.get('run', '') for step in job['steps'])
                for name, job in jobs['test'].items()}
    assert 'scripts/test --python' in commands.pop('pythons')
    assert all('.ci/run' in command for command in commands.values())
    assert jobs['release']['publish']['needs'] == ['build', 'compiled']
    assert {jobs['release'][name]['needs'] for name in ('build', 'compiled')} == {'test'}
    assert [name for name, job in jobs['release'].items()
            if 'id-token' in job.get('permissions', ())] == ['publish']
