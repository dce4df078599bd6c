# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_archive: many bags on real workers, some of which are killed."""

from collections import Counter
import csv
from html.parser import HTMLParser
import json
import os
import sys
from unittest.mock import patch
import zipfile

from bags import file_of, Message, START, write_ros2
from deadly import Deadly
from patients import FAULTY, HEALTHY
from programs import completed
import pytest
from tf_tree_py.core import Pose
from tf_tree_py.tools.archive.jobs import BagPath, bags_in, done, Ledger
from tf_tree_py.tools.archive.running import client_of, results
from tool_helpers import tool

pytest.importorskip('distributed')
dask = pytest.importorskip('dask')
psutil = pytest.importorskip('psutil')


@pytest.fixture(scope='module')
def client():
    # dask sets variables for the workers that it starts, and leaves them.
    with patch.dict(os.environ), client_of(None, 2) as client:
        yield client


@pytest.fixture(scope='module')
def archive(tmp_path_factory):
    """Return a folder with bags: two healthy, one with an error, one truncated, one of junk."""
    folder = tmp_path_factory.mktemp('archive')
    for name, messages in (('well', HEALTHY['warehouse_robot']()),
                           ('error', FAULTY['two_parents'])):
        write_ros2(folder / name, sorted(messages, key=lambda each: each.received))
    data = file_of(folder / 'well').read_bytes()
    (folder / 'alone.mcap').write_bytes(data)
    (folder / 'cut.mcap').write_bytes(data[:-1000])
    (folder / 'junk.mcap').write_bytes(b'<script>' * 100)
    (folder / 'notes.txt').write_text('no bag')
    return folder


@pytest.fixture(scope='module')
def scheduler(client):
    return ['--scheduler', client.scheduler.address]


class Page(HTMLParser):
    """The links, the loaded files and the cell texts of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loaded, self.cells = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        """Store links and loaded files."""
        self.links += [value for name, value in attributes if name == 'href']
        self.loaded += [value for name, value in attributes if name == 'src' or tag == 'link']

    def handle_data(self, data):
        """Store texts."""
        self.cells += [data.strip()] if data.strip() else []


def rows_of(folder):
    return {row['bag'].rpartition('/')[2]: row
            for row in json.loads((folder / 'table.json').read_text())['rows']}


def test_every_bag_costs_its_own_row_the_worst_first(archive, scheduler, tmp_path):
    out = tmp_path / 'report'
    done = tool('tf_archive', 'report', f'{archive}/**', '-o', out, *scheduler)
    assert done.returncode == 1
    rows = rows_of(out)
    assert {name: row['outcome'] for name, row in rows.items()} == {
        'junk.mcap': 'broken', 'error': 'error', 'cut.mcap': 'warning', 'alone.mcap': 'fine',
        'well': 'fine'}
    assert list(rows)[:3] == ['junk.mcap', 'error', 'cut.mcap']
    assert 'cannot be read as a bag' in rows['junk.mcap']['reason']
    assert rows['error']['errors'] == 1 and rows['error']['codes'].split()[0] == 'two_parents'
    assert '5 bags: 1 broken, 1 error, 1 warning, 2 fine' in done.stdout
    with (out / 'table.csv').open() as file:
        for told, row in zip(csv.DictReader(file), rows.values(), strict=True):
            assert told == {name: str(row.get(name, '')) for name in told}
    page = Page((out / 'index.html').read_text())
    assert page.links == [row['file'] for row in rows.values() if row['file']]
    assert not page.loaded and [cell for cell in page.cells if cell in map(str, archive.iterdir())
                                ] == [row['bag'] for row in rows.values()]
    report = Page((out / rows['error']['file']).read_text())
    assert 'error two_parents' in report.cells and not report.loaded
    as_data = json.loads((out / rows['error']['file']).with_suffix('.json').read_text())
    assert as_data['source'] == rows['error']['bag'] and as_data['errors'] == 1


def test_second_run_goes_on_where_the_first_stopped(archive, scheduler, tmp_path):
    copies = [tmp_path / f'{name}.mcap' for name in ('done', 'changed', 'new')]
    out = tmp_path / 'report'

    def run(*more):
        done = tool('tf_archive', 'report', f'{tmp_path}/*.mcap', '-o', out, *scheduler, *more)
        assert done.returncode == 0
        return {path.name.partition('.')[0]: path.stat().st_mtime_ns
                for path in (out / 'rows').iterdir()}

    data = (archive / 'alone.mcap').read_bytes()
    for copy in copies[:2]:
        copy.write_bytes(data)
    first = run()
    copies[1].write_bytes(data + b'\0')
    copies[2].write_bytes(data)
    second = run()
    assert second.keys() == {'done', 'changed', 'new'} and len(rows_of(out)) == 3
    assert second['done'] == first['done'] and second['changed'] > first['changed']
    others = run('--max-speed', '7')
    assert all(others[name] > second[name] for name in second)
    assert run('--max-speed', '7') == others
    again = run('--max-speed', '7', '--again')
    assert all(again[name] > others[name] for name in others)


def test_killed_workers_lose_only_the_bags_that_kill_them(
        client, tmp_path):
    folder = tmp_path / 'bags'
    folder.mkdir()
    job = Deadly(folder)
    names = [f'bag{number}' for number in range(12)]
    bags = [BagPath(str(tmp_path / name), '') for name in
            (*names[:4], 'bomb', *names[4:8], 'once', *names[8:])]
    ledger = Ledger(tmp_path / 'out', job)
    rows = [ledger.keep(bag, result) for bag, result in results(client, job, bags)]
    assert Counter(row['bag'] for row in rows) == Counter(bag.path for bag in bags)
    lost = [row for row in rows if row['outcome'] != 'fine']
    assert [(row['bag'], row['outcome']) for row in lost] == [(f'{tmp_path}/bomb', 'lost')]
    assert 'every worker that read it was killed' in lost[0]['reason']
    # Results that a worker had not handed over when it was killed were computed again.
    tried = Counter(path.name.partition(' ')[0] for path in folder.iterdir())
    assert tried['bomb'] == 2 and tried['once'] >= 2
    # A lost bag is processed again; a finished one is not.
    assert [bag.path for bag in bags if ledger.finished(bag) is None] == [f'{tmp_path}/bomb']


def test_worker_that_takes_long_to_return_is_waited_for(tmp_path):
    # By default dask waits for 15 s, which a busy machine exceeds.
    short = dask.config.set({'distributed.deploy.lost-worker-timeout': '1ms'})
    with patch.dict(os.environ), short, client_of(None, 1) as client:
        bags = [BagPath(str(tmp_path / name), '') for name in ('once', 'other')]
        found = list(results(client, Deadly(tmp_path), bags))
    assert sorted(bag.path for bag, _ in found) == [bag.path for bag in bags]
    assert [result.row['outcome'] for _, result in found] == ['fine', 'fine']


def test_what_cannot_be_written_costs_that_row(archive, tmp_path):
    job = Deadly(tmp_path)
    ledger = Ledger(tmp_path, job)
    bags = bags_in([str(archive / 'well'), str(archive / 'error')])
    (tmp_path / 'bags' / f'{bags[0].name}.txt').mkdir()
    rows = [ledger.keep(bag, done(job, bag.path)) for bag in bags]
    assert [row['outcome'] for row in rows] == ['lost', 'fine']
    assert rows[0]['reason'] == 'cannot be written: Is a directory'
    assert [ledger.finished(bag) for bag in bags] == [None, rows[1]]
    half = next((tmp_path / 'rows').iterdir())
    half.write_bytes(half.read_bytes()[:40])
    assert ledger.finished(bags[1]) is None


def test_nobody_but_this_machine_reaches_the_cluster_and_its_dashboards(client):
    here = psutil.Process()
    listening = [connection.laddr.ip for process in (here, *here.children(recursive=True))
                 for connection in process.net_connections('tcp')
                 if connection.status == psutil.CONN_LISTEN]
    assert len(listening) >= 6 and set(listening) == {'127.0.0.1'}


def test_export_is_that_of_tf_export(archive, scheduler, tmp_path):
    out, file = tmp_path / 'out', tmp_path / 'one.csv'
    arguments = ['--rate', '20', '--twist', '--format', 'csv']
    done = tool('tf_archive', 'export', 'map', 'lidar', f'{archive}/*', '-o', out, *arguments,
                *scheduler)
    assert done.returncode == 1
    rows = rows_of(out)
    assert {name: row['outcome'] for name, row in rows.items()} == {
        'junk.mcap': 'broken', 'cut.mcap': 'warning', 'error': 'fine', 'alone.mcap': 'fine',
        'well': 'fine'}
    tool('tf_export', archive / 'well', 'map', 'lidar', '-o', file, *arguments)
    assert (out / rows['well']['file']).read_bytes() == file.read_bytes()
    assert rows['well']['poses'] == len(file.read_text().splitlines()) - 1


def test_bags_may_be_wherever_fsspec_looks(archive, scheduler, tmp_path):
    packed = tmp_path / 'bags.zip'
    with zipfile.ZipFile(packed, 'w') as file:
        for path in (archive / 'well').iterdir():
            file.write(path, f'run/{path.name}')
        file.write(archive / 'alone.mcap', 'alone.mcap')
    out = tmp_path / 'report'
    done = tool('tf_archive', 'report', f'zip://**::{packed}', f'file://{archive}/al*', '-o', out,
                *scheduler)
    assert done.returncode == 0
    rows = json.loads((out / 'table.json').read_text())['rows']
    assert sorted(row['bag'] for row in rows) == [
        f'file://{archive}/alone.mcap', f'zip://alone.mcap::{packed}', f'zip://run::{packed}']
    assert len({row['transforms'] for row in rows}) == 1


def test_splits_are_one_bag_and_what_is_none_is_left_out(tmp_path):
    run = write_ros2(tmp_path / 'run', [Message(START, '/tf', [
        ('map', 'base', START, tuple(Pose()))])])
    for name in ('a.mcap', 'b.bag', 'c.db3.zstd', 'd.txt', 'e.mcap.zst', 'f.zst'):
        (tmp_path / name).touch()
    found = [f'{tmp_path}/a.mcap', f'{tmp_path}/b.bag', f'{tmp_path}/c.db3.zstd',
             f'{tmp_path}/e.mcap.zst', str(run)]
    assert sorted(bag.path for bag in bags_in([f'{tmp_path}/**'])) == found
    assert [bag.path for bag in bags_in([f'{tmp_path}/**/*.mcap'])] == [found[0], found[4]]
    assert [bag.path for bag in bags_in([f'{tmp_path}/missing.mcap'])] == [
        f'{tmp_path}/missing.mcap']
    assert len({bag.name for bag in bags_in([f'{tmp_path}/x/run', f'{tmp_path}/y/run'])}) == 2


@pytest.mark.parametrize('arguments, sentence', [
    (['report', 'nothing/*.mcap'], 'no bag matches nothing/'),
    (['report', 'x.mcap', '--workers', '0'], "'0' is not a whole number greater than zero"),
    (['report', 'x.mcap', '--scheduler', 'nonsense://1'], 'no scheduler answers at nonsense://1'),
    (['report', 'unheard://x/*.mcap'], 'unheard://x/*.mcap cannot be opened'),
    (['report', 'x.mcap', '-o', '/proc/report'], '/proc/report cannot be made'),
    (['export', 'map', 'x.mcap'], 'the following arguments are required: GLOB'),
    (['look', 'x.mcap'], "invalid choice: 'look'"),
    ([], 'the following arguments are required: verb')])
def test_what_cannot_be_done_is_one_sentence(tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    done = tool('tf_archive', *arguments)
    line, = done.stderr.splitlines()
    assert done.returncode == 2 and sentence in line


HIDDEN = """
import sys
sys.modules.update(dict.fromkeys(['distributed', 'dask']))
from tf_tree_py.tools.tf_archive import main
sys.exit(main())
"""


def test_missing_dask_is_one_sentence(archive, tmp_path):
    done = completed(sys.executable, '-c', HIDDEN, 'report', archive / 'well', cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, '')
    line, = done.stderr.splitlines()
    assert line.startswith('tf_archive: ') and 'pip install distributed' in line


def test_own_workers_of_a_real_process_leave_nothing_behind(archive, tmp_path):
    command = [sys.executable, '-m', 'tf_tree_py.tools.tf_archive', 'report', archive / 'well',
               '--workers', '1', '--json']
    done = completed(*command, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, '')
    assert json.loads(done.stdout)['outcomes'] == {'fine': 1}
    assert sorted(path.name for path in tmp_path.iterdir()) == ['archive_report']
