# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The output of all tools for each fault is that on the pages of the doctor."""

from pathlib import Path

from patients import FAULTY, written
import pytest
from tool_helpers import tool

rclpy = pytest.importorskip('rclpy')

DOCS = Path(__file__).parents[2] / 'docs'


@pytest.fixture(scope='module')
def node():
    from rclpy.node import Node
    context = rclpy.context.Context()
    rclpy.init(context=context, args=[])
    node = Node('verdicts', context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize('code', FAULTY)
def test_every_tool_says_what_the_page_says(code, node, tmp_path):
    from verdicts import HEADINGS, row, verdicts
    lines = (DOCS / 'doctor_coverage.md').read_text().splitlines()
    assert row(HEADINGS) in lines
    assert row(verdicts(code, written(code, tmp_path), node)) in lines, (
        'python test/tools/verdicts.py in scripts/env prints the table')


def test_sample_on_the_page_is_what_the_doctor_prints(tmp_path, monkeypatch):
    bag = written('two_publishers', tmp_path).rename(tmp_path / 'run')
    assert bag.is_dir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('COLUMNS', '120')
    printed = tool('tf_doctor', '--bag', 'run').stdout
    sample = (DOCS / 'doctor.md').read_text().partition('```text\n')[2].partition('```')[0]
    assert [line.rstrip() for line in printed.splitlines()] == sample.splitlines()
