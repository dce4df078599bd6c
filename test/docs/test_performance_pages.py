# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The benchmark finds its results on the pages of performance, and can renew them."""

from pathlib import Path

from benchmark import report
from benchmark.rows import Row

DOCS = Path(__file__).parents[2] / 'docs'
MACHINE = dict.fromkeys(('python', 'numpy', 'scipy', 'rclpy', 'rmw', 'transform-tree',
                         'pytransform3d', 'commit'), '') | {
    'cpu': 'a processor', 'cores': 2, 'date': 'today'}


def test_every_page_has_rows_of_its_groups_alone():
    found = {row.group for row in report.rows_of(DOCS)}
    assert found <= {group for groups in report.PAGES.values() for group in groups}
    for page, groups in report.PAGES.items():
        results = (DOCS / page).read_text().partition('<!-- results: begin -->')[2]
        titles = results.count('\n### ') - 1  # without that of the ratios
        assert titles == len(found & set(groups)) > 0, page


def test_results_of_a_run_replace_those_on_the_pages(tmp_path):
    for page in report.PAGES:
        (tmp_path / page).write_text((DOCS / page).read_text())
    rows = [Row('depth', 'middle, depth 1', 'us', {'tf_tree_py': [1.0, 2.0, 3.0]}),
            Row('wait', 'over DDS, p50', 'ms', {'tf_tree_py': [4.0]}),
            Row('memory', 'samples', 'bytes a sample', {'tf_tree_py': [64.0]}),
            Row('uncertain', '5 moving edges', 'us', {'plain': [9.0]})]
    report.update_pages(tmp_path, rows, MACHINE, {})
    assert [(row.group, row.name) for row in report.rows_of(tmp_path)] == [
        ('depth', 'middle, depth 1'), ('wait', 'over DDS, p50'), ('memory', 'samples')]
    for page in report.PAGES:
        before, after = ((folder / page).read_text().partition('<!-- results')[0]
                         for folder in (DOCS, tmp_path))
        assert before == after


def test_pages_name_every_group_that_is_theirs():
    for page, groups in report.PAGES.items():
        only = f'scripts/bench --only {" ".join(groups)}\n'
        assert sorted(only.split()) == sorted(next(
            line.split() for line in (DOCS / page).read_text().splitlines()
            if line.startswith('scripts/bench --only'))), page
