# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The numbers in the text are those of the tables: the benchmark writes and renews both."""

from dataclasses import replace
from pathlib import Path
import re
import shutil

from benchmark import figures, options, publishing, report, stored
from benchmark.__main__ import GROUPS
from benchmark.passages import PASSAGES
from benchmark.rows import DEBIAN, GTSAM, JAZZY, OURS, PURE, Row, TF2_ROS
from benchmark.timing import Spread
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / 'docs'
MACHINE = dict.fromkeys(('python', 'numpy', 'scipy', 'rclpy', 'rmw', 'transform-tree',
                         'pytransform3d'), '') | {
    'cpu': 'a processor', 'cores': 2, 'date': '2027-02-03T04:05:06+00:00', 'commit': 'abcdef1'}

# The pages that quote results, beside those of the results.
QUOTING = {'README.md', 'docs/beyond_tf2.md', 'docs/calibration.md', 'docs/continuous_time.md',
           'docs/doctor.md', 'docs/fleet.md', 'docs/installing.md', 'docs/performance.md',
           'docs/recorded_trees.md', 'docs/robot_description.md',
           'docs/several_robots.md', 'docs/shared_tree.md', 'docs/tools.md'}

# Figures of a benchmark in a table: numbers with one of its units.
_FIGURE = re.compile(r'(?<![\w.])\d[\d,.]*(?= (?:us|ms|bytes|%))')


@pytest.fixture
def copy(tmp_path):
    """Return a copy of the pages, without plots."""
    shutil.copy(REPOSITORY / 'README.md', tmp_path)
    shutil.copytree(DOCS, tmp_path / 'docs', ignore=shutil.ignore_patterns(
        'images', 'labs', 'figures', '__pycache__'))
    return tmp_path


@pytest.fixture
def no_plots(monkeypatch):
    """Leave the plots out."""
    monkeypatch.setattr(publishing, 'draw', lambda folder, rows: None)


def texts(repository):
    """Return all pages."""
    return {page.relative_to(repository).as_posix(): page.read_text()
            for page in [repository / 'README.md', *(repository / 'docs').glob('*.md')]}


def stale(repository):
    """Return the passages whose figures are not those of the tables."""
    results = stored.results_of(repository / 'docs')
    pages = texts(repository)
    return [passage.words for passage in PASSAGES
            if passage.renewed(pages[passage.page], results) != pages[passage.page]]


def scaled(results, factor):
    """Return rows as a run measures them, with other numbers, and all of their ratios."""
    rows = [Row(row.group, row.name, row.unit, {
        way: [value * factor for value in sorted(values)] for way, values in row.values.items()})
        for row in results.rows]
    for group, ratio in results.ratios:
        other = replace(ratio, spread=Spread(*(factor * part for part in ratio.spread)))
        next(row for row in rows if row.group == group).comparisons.append(other)
    return rows


def test_figures_of_all_passages_are_those_of_the_tables():
    assert {passage.page for passage in PASSAGES} - {f'docs/{page}' for page in report.PAGES} == (
        QUOTING)
    assert stale(REPOSITORY) == []


def test_each_passage_is_at_one_place_of_its_page():
    pages = texts(REPOSITORY)
    spans = {}
    for passage in PASSAGES:
        found = passage.find(pages[passage.page])       # it raises otherwise
        for number in range(1, len(passage.figures) + 1):
            spans.setdefault((passage.page, found.span(number)), []).append(passage.words)
    assert {place: words for place, words in spans.items() if len(words) > 1} == {}


def test_a_changed_cell_is_noticed(copy):
    page = copy / 'docs' / 'performance_lookups.md'
    text, count = re.subn(r'(\n\| 30 ms old, depth 5 +\| us   \| \S+ \()\S+', r'\g<1>1.23',
                          page.read_text())
    assert count == 1
    page.write_text(text)
    assert [words for words in stale(copy) if 'over 5 moving edges' in words]


def test_a_changed_figure_is_noticed_and_renewed(copy, no_plots):
    page = copy / 'README.md'
    before = page.read_text()
    page.write_text(before.replace('| one lookup of 30 ms ago over 1 moving edge | ',
                                   '| one lookup of 30 ms ago over 1 moving edge | 9'))
    assert len(stale(copy)) == 1
    publishing.renew(copy)
    assert page.read_text() == before


def test_tables_of_main_results_have_only_figures_of_passages():
    pages = texts(REPOSITORY)
    for page, begin, end in (('README.md', '### What was measured', '## Status'),
                             ('docs/performance.md', '## Results', '## What to choose by')):
        text = pages[page]
        covered = [passage.find(text).span() for passage in PASSAGES if passage.page == page]
        for found in _FIGURE.finditer(text, text.index(begin), text.index(end)):
            # The age of a stamp is of the task, and no result.
            if not text.startswith('30 ms ago', found.start()):
                assert any(first <= found.start() < last for first, last in covered), (
                    page, text[found.start() - 60:found.end() + 3])


def test_renewing_changes_nothing_on_unchanged_pages(copy, no_plots):
    publishing.renew(copy)
    assert texts(copy) == texts(REPOSITORY)


def test_a_run_with_other_numbers_renews_all_pages(copy, no_plots):
    before = stored.results_of(DOCS)
    publishing.publish(copy, scaled(before, 3.0), MACHINE, {})
    assert stale(copy) == []
    after = stored.results_of(copy / 'docs')
    assert [(row.group, row.name, list(row.values)) for row in after.rows] == [
        (row.group, row.name, list(row.values)) for row in before.rows]
    assert set(after.runs.values()) == {stored.Run('3 February 2027', 'abcdef1')}
    assert 'the run of 3 February 2027 (commit abcdef1)' in (
        copy / 'docs' / 'performance.md').read_text()
    # Only figures differ: with those of before, the text is that of before.
    figures.renew(copy, PASSAGES, before)
    now, then = texts(copy), texts(REPOSITORY)
    assert {page: now[page] for page in QUOTING} == {page: then[page] for page in QUOTING}


def test_a_run_of_one_page_leaves_the_others(copy, no_plots):
    before = stored.results_of(DOCS)
    rows = [row for row in scaled(before, 3.0) if row.group == 'shared']
    publishing.publish(copy, rows, MACHINE, {})
    assert stale(copy) == []
    runs = stored.results_of(copy / 'docs').runs
    assert runs.pop('performance_shared.md') == stored.Run('3 February 2027', 'abcdef1')
    assert runs == {page: run for page, run in before.runs.items() if page in runs}
    changed = {page for page, text in texts(copy).items() if text != texts(REPOSITORY)[page]}
    assert changed == {'docs/performance_shared.md', 'docs/shared_tree.md'}


@pytest.mark.parametrize(('given', 'why'), [
    (['--only', 'wait', 'listener'], 'needs all groups of a page'),
    (['--only', 'shared', '--quick'], 'not with --quick')])
def test_a_part_of_a_page_is_not_published(given, why, capsys):
    assert options.parse(['--docs', '--only', *report.PAGES['performance_shared.md']]).docs
    with pytest.raises(SystemExit):
        options.parse(['--docs', *given])
    assert why in capsys.readouterr().err


def test_results_of_a_run_replace_those_on_the_pages(copy):
    rows = [Row('depth', 'middle, depth 1', 'us', {'tf_tree_py': [1.0, 2.0, 3.0]}),
            Row('wait', 'over DDS, p50', 'ms', {'tf_tree_py': [4.0]}),
            Row('shared', 'receiving', '% of a core', {'tf_tree_py': [0.5]}),
            Row('memory', 'samples', 'bytes a sample', {'tf_tree_py': [64.0]}),
            Row('uncertain', '5 moving edges', 'us', {'plain': [9.0], 'large': [1234.5]}),
            Row('growth_bags', 'list, 1 bag', 'ms a bag', {'tf_tree_py': [0.5]})]
    rows[0].compare('tf_tree_py', 'tf_tree_py', 1.5, unit='x itself')
    report.update_pages(copy / 'docs', rows, MACHINE, {})
    results = stored.results_of(copy / 'docs')
    assert [(row.group, row.name) for row in results.rows] == [
        (row.group, row.name) for row in rows]
    assert results.measured('depth', 'middle, depth 1', 'tf_tree_py') == (1.0, 2.0, 3.0)
    assert results.ratio('depth', 'middle, depth 1', 'x itself') == (1.0, 1.0, 1.0)
    for page in report.PAGES:
        before, after = ((folder / page).read_text().partition('<!-- results')[0]
                         for folder in (DOCS, copy / 'docs'))
        assert before == after


def test_run_without_a_quoted_contestant_changes_no_page(copy):
    rows = scaled(stored.results_of(DOCS), 1.0)
    for row in rows:
        row.values.pop(TF2_ROS, None)
    before = texts(copy)
    with pytest.raises(SystemExit, match='the pages stay as they are, .* tf2_ros in wait: over'):
        publishing.publish(copy, rows, MACHINE, {})
    assert texts(copy) == before


def test_absent_contestants_that_are_quoted_are_named_with_their_remedy():
    with pytest.raises(SystemExit) as refused:
        publishing.refuse_absent({GTSAM: 'pip install gtsam', 'a turtle': 'buy one',
                                  'Rust, chain38': 'too long'})
    assert str(refused.value) == (
        'benchmark: --docs needs what the pages quote: GTSAM (pip install gtsam)')
    publishing.refuse_absent({'a turtle': 'buy one'})


def test_similar_names_of_contestants_are_distinguished():
    def quoted(figure):
        absent = dict.fromkeys((DEBIAN, JAZZY, TF2_ROS, 'tf2', PURE), 'absent')
        return set(figures.quoted([figures.Passage('a.md', '{}', [figure])], absent))

    assert quoted(figures.Measured('g', 'n', contestant=JAZZY)) == {JAZZY}
    assert quoted(figures.Measured('g', 'n', contestant=f'{JAZZY}, one by one')) == {JAZZY}
    assert quoted(figures.Measured('g', 'n')) == set()
    assert quoted(figures.Ratio('g', 'n', unit=f'x a loop of {DEBIAN}')) == {DEBIAN}
    assert quoted(figures.FasterUpTo('n', TF2_ROS, (1,), PURE)) == {TF2_ROS, PURE}
    assert quoted(figures.Date('p')) == quoted(figures.Commit('p')) == set()


@pytest.mark.parametrize(('ours', 'reached'), [
    ([9.0, 11.0, 9.0], '1'), ([9.0, 10.0, 11.0], '5'), ([1.0, 1.0, 1.0], '38'),
    ([10.1, 1.0, 1.0], '0')])
def test_depth_up_to_which_lookups_are_faster(ours, reached):
    depths = 1, 5, 38
    rows = [Row('depth', f'kind, depth {depth}', 'us', {
        OURS: [99.0, mine, 99.0], TF2_ROS: [50.0, 10.0, 70.0]})
        for depth, mine in zip(depths, ours, strict=True)]
    results = stored.of_run(rows, MACHINE)
    assert figures.FasterUpTo('kind', TF2_ROS, depths).text(results) == reached


def test_figures_have_two_digits():
    numbers = 0.145, 0.0996, 9.96, 99.6, 1466.0, 7.0, 0.1, 0.0, 1e-5, 12345.6
    assert [figures.rounded(number) for number in numbers] == [
        '0.15', '0.10', '10', '100', '1,500', '7.0', '0.10', '0', '0.000010', '12,000']


def test_every_page_has_rows_of_its_groups_alone():
    found = {row.group for row in stored.results_of(DOCS).rows}
    assert found <= {group for groups in report.PAGES.values() for group in groups}
    for page, groups in report.PAGES.items():
        results = (DOCS / page).read_text().partition('<!-- results: begin -->')[2]
        titles = results.count('\n### ') - 1  # without that of the ratios
        assert titles == len(found & set(groups)) > 0, page


def test_every_group_has_a_page():
    assert sorted(GROUPS) == sorted(
        group for groups in report.PAGES.values() for group in groups)


def test_pages_name_every_group_that_is_theirs():
    for page, groups in report.PAGES.items():
        only = f'scripts/bench --only {" ".join(groups)}\n'
        assert sorted(only.split()) == sorted(next(
            line.split() for line in (DOCS / page).read_text().splitlines()
            if line.startswith('scripts/bench --only'))), page
