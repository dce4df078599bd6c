# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command: it lists, runs, prints, draws; also without ROS and matplotlib."""

import json
import re
import subprocess
import sys

from lab_reports import report_of
from programs import completed, PATIENCE_S
import pytest
from tf_tree_py.labs.catalogue import LABS
from tf_tree_py.labs.report import Column, Report, save, Table
from tf_tree_py.labs.tf_lab import main

ALL = ['order', 'direction', 'planar', 'latency', 'interpolation', 'warehouse', 'startup',
       'static-spam', 'cycle', 'remount', 'one-edge', 'uncertainty', 'calibrate', 'continuous',
       'gyro', 'prediction', 'switch-over', 'anchor', 'splat']


@pytest.fixture
def tf_lab(monkeypatch, tmp_path):
    """Run the command in an empty folder, with labs that have already been run."""
    monkeypatch.chdir(tmp_path)
    for name, lab in LABS.items():
        monkeypatch.setitem(LABS, name, lab._replace(run=lambda name=name: report_of(name)))
    return lambda *arguments: main(['tf_lab', *arguments])


def test_every_lab_has_a_line(tf_lab, capsys):
    assert tf_lab() == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:len(ALL)]] == ALL
    assert all(len(line) < 100 for line in lines)


def test_list_as_json_says_which_have_a_variant_over_dds(tf_lab, capsys):
    assert tf_lab('--json') == 0
    listed = json.loads(capsys.readouterr().out)
    assert {lab['name'] for lab in listed if lab['ros']} == {
        'latency', 'remount', 'one-edge', 'startup', 'static-spam', 'cycle', 'anchor'}


@pytest.mark.parametrize('name', ALL)
def test_lab_prints_its_tables_and_its_law(name, tf_lab, capsys, monkeypatch):
    # Each lab's picture is drawn in test_pictures.
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    assert tf_lab(name) == 0
    out = capsys.readouterr().out
    assert '\nThe law: ' in out and '\n-----' in out


@pytest.mark.parametrize('name', ['order', 'splat'])
def test_lab_draws(name, tf_lab, capsys, tmp_path):
    pytest.importorskip('matplotlib')
    assert tf_lab(name) == 0
    out = capsys.readouterr().out
    assert f'The picture: {name}.png, {name}.svg' in out
    assert sorted(path.name for path in tmp_path.iterdir()) == [f'{name}.png', f'{name}.svg']
    assert (tmp_path / f'{name}.png').read_bytes().startswith(b'\x89PNG')
    assert '</svg>' in (tmp_path / f'{name}.svg').read_text()


@pytest.mark.parametrize('name', ALL)
def test_lab_says_the_same_as_json_and_draws_nothing(name, tf_lab, capsys, tmp_path):
    assert tf_lab(name, '--json') == 0
    said = json.loads(capsys.readouterr().out)
    assert said['lab'] == name and said['law'] == report_of(name).law
    assert said['numbers'] and said['pictures'] == []
    assert all(table['rows'] for table in said['tables'])
    assert not list(tmp_path.iterdir())


def test_json_draws_where_it_is_told_to(tf_lab, capsys, tmp_path):
    pytest.importorskip('matplotlib')
    assert tf_lab('order', '--json', '--out', 'a/b') == 0
    assert json.loads(capsys.readouterr().out)['pictures'] == ['a/b/order.png', 'a/b/order.svg']
    assert (tmp_path / 'a' / 'b' / 'order.svg').exists()


def test_picture_is_the_same_every_time(tmp_path):
    pytest.importorskip('matplotlib')
    first, again = ([path.read_bytes() for path in save(
        report_of('order').draw, tmp_path, 'order')] for _ in range(2))
    assert first == again
    assert not re.search(rb'\d\d:\d\d:\d\d|Matplotlib v', first[1])


def test_without_matplotlib_the_table_is_printed_and_what_to_install(tf_lab, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    assert tf_lab('planar') == 0
    out = capsys.readouterr().out
    assert 'h sin(lean)' in out and 'pip install matplotlib' in out


def test_without_matplotlib_json_stays_json(tf_lab, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    assert tf_lab('planar', '--json', '--out', '.') == 0
    out, err = capsys.readouterr()
    assert json.loads(out)['pictures'] == [] and 'pip install' in err


def test_folder_that_cannot_be_is_one_sentence(tf_lab, capsys, tmp_path):
    pytest.importorskip('matplotlib')
    (tmp_path / 'file').touch()
    assert tf_lab('order', '--out', 'file') == 0
    assert 'No picture: ' in capsys.readouterr().out


# The first line of programs for which neither rclpy nor matplotlib is installed.
_NOTHING_INSTALLED = 'import sys; sys.modules.update(rclpy=None, matplotlib=None)\n'


def _alone(code):
    return completed(sys.executable, '-c', _NOTHING_INSTALLED + code)


def test_labs_run_without_ros_and_without_matplotlib():
    """All labs are imported, and two are run; ``report_of`` runs all of them like this."""
    done = _alone('from tf_tree_py.labs.tf_lab import main\n'
                  'for name in "order", "direction": main(["tf_lab", name])\n'
                  'assert not any(name.startswith("tf_tree_py.ros") for name in sys.modules)')
    assert done.returncode == 0, done.stderr
    shown = done.stdout
    assert shown.count('\nThe law: ') == shown.count('pip install matplotlib') == 2
    # A slow machine prints progress.
    assert all(' s so far, Ctrl-C ends it' in line for line in done.stderr.splitlines())


def test_over_dds_without_ros_is_one_sentence():
    done = _alone('from tf_tree_py.labs.tf_lab import main\n'
                  'sys.exit(main(["tf_lab", "latency", "--ros"]))')
    assert done.returncode == 2 and done.stdout == ''
    line, = done.stderr.splitlines()
    assert line.startswith('tf_lab: --ros needs ROS 2, and rclpy is not installed: source ')
    assert line.endswith('; tf_lab latency runs without')


@pytest.mark.parametrize('arguments, sentence', [
    (['lateness'], "there is no lab 'lateness'; there are order, direction"),
    (['order', '--ros'], 'order has no version over DDS; the labs with --ros are latency'),
])
def test_called_wrongly_is_one_sentence(arguments, sentence, tf_lab, capsys):
    assert tf_lab(*arguments) == 2
    out, err = capsys.readouterr()
    assert out == '' and sentence in err and err.count('\n') == 1


def test_reader_that_leaves_is_no_failure():
    command = [sys.executable, '-m', 'tf_tree_py.labs', 'planar', '--json']
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.wait(PATIENCE_S) == 0
        assert process.stderr.read() == b''


def test_table_is_readable():
    table = Table('What', (Column('name', 'name'), Column('off_m', 'off [cm]', '.1f'),
                           Column('ok', 'ok')),
                  [('a', 0.123, True), ('longer', -1e-15, False), ('none', None, True)])
    assert table.as_text().splitlines() == [
        'What',
        'name    off [cm]   ok',
        '------  --------  ---',
        'a           12.3  yes',
        'longer       0.0   no',
        'none           -  yes']
    assert [row['off_m'] for row in table.as_dict()['rows']] == [0.123, -1e-15, None]


def test_report_without_a_picture_says_no_more(tf_lab, capsys, monkeypatch, tmp_path):
    plain = Report([Table('T', (Column('a', 'a'),), [(1,)])], 'it holds.')
    monkeypatch.setitem(LABS, 'order', LABS['order']._replace(run=lambda: plain))
    assert tf_lab('order') == 0
    assert capsys.readouterr().out.endswith('The law: it holds.\n\n')
    assert not list(tmp_path.iterdir())
