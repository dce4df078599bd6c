# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_frames: the tree of a bag on the terminal and in files."""

import itertools
import json
import re

from bags import write_ros2
from patients import FAULTY, HEALTHY
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.reports.frame_graph import frame_graph
from tf_tree_py.tools.tf_frames import places
from tool_helpers import assert_one_sentence, assert_shape, tool


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('frames')
    return {name: write_ros2(folder / name, sorted(messages, key=lambda each: each.received))
            for name, messages in (('well', HEALTHY['warehouse_robot']()),
                                   ('humanoid', HEALTHY['humanoid']()),
                                   ('loop', FAULTY['loop']),
                                   ('unconnected', FAULTY['unconnected']))}


def test_tree_is_drawn_with_what_is_wrong_in_words(bags):
    done = tool('tf_frames', '--bag', bags['loop'])
    assert done.returncode == 1
    assert done.stdout.splitlines()[:4] == [
        'map', '└─ odom           20.0 Hz     ', '   └─ base_link   50.0 Hz     ',
        '      ├─ lidar    static      ']
    assert 'tool -> base_link would close a loop and is refused' in done.stdout
    two = tool('tf_frames', '--bag', bags['unconnected'])
    assert (two.returncode, two.stdout.count('a separate tree')) == (1, 2)


def test_frames_too_deep_for_the_terminal_keep_their_names(bags, monkeypatch):
    monkeypatch.setenv('COLUMNS', '60')
    lines = tool('tf_frames', '--bag', bags['humanoid']).stdout.splitlines()
    deep = next(line for line in lines if 'link_29' in line)
    assert re.match(r'\d+ deep +└─ link_29 +50.0 Hz', deep)
    assert max(map(len, lines)) <= 60


@pytest.mark.parametrize('name, status', [('well', 0), ('loop', 1), ('humanoid', 0)])
def test_json_has_the_documented_shape(bags, name, status, tmp_path):
    done = tool('tf_frames', '--bag', bags[name], '--json')
    assert done.returncode == status
    report = json.loads(done.stdout)
    assert_shape(report, 'tools', '### The frames')
    for edge in report['edges']:
        assert_shape(edge, 'tools', '### An edge of the frames')
    for edge in report['refused']:
        assert_shape(edge, 'tools', '### A refused edge')
    file = tmp_path / 'frames.json'
    assert tool('tf_frames', '--bag', bags[name], '-o', file).returncode == status
    assert json.loads(file.read_text()) == report


@pytest.mark.parametrize('suffix, begin', [
    ('.svg', b'<?xml'), ('.png', b'\x89PNG'), ('.pdf', b'%PDF'), ('.dot', b'digraph'),
    ('.mmd', b'flowchart')])
def test_suffix_says_what_is_written(bags, tmp_path, suffix, begin):
    file = tmp_path / f'frames{suffix}'
    done = tool('tf_frames', '--bag', bags['loop'], '-o', file)
    assert done.stdout == f'7 frames: {file}\n'
    assert file.read_bytes().startswith(begin)


def test_view_frames_draws_a_pdf_with_the_time_in_its_name(bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert tool('tf_frames', '--bag', bags['well'], entry='view_frames').returncode == 0
    file, = tmp_path.iterdir()
    assert re.fullmatch(r'frames_\d{4}-\d\d-\d\d_\d\d\.\d\d\.\d\d\.pdf', file.name)


def test_no_two_boxes_of_a_drawing_stand_on_each_other():
    buffer = BufferCore()
    for number in range(1, 41):
        buffer.insert(f'frame_{number * 2 // 5}', f'frame_{number}', 0, Pose(), static=True)
    buffer.insert('another', 'tree', 0, Pose(), static=True)
    boxes = places(frame_graph(buffer))
    assert len(boxes) == 43
    rows = {}
    for box in boxes.values():
        rows.setdefault(box.column, []).append(box.row)
    for column in rows.values():
        column.sort()
        assert all(below - above >= 1.0 for above, below in itertools.pairwise(column))


@pytest.mark.parametrize('file, sentence', [
    ('frames.doc', 'none of the supported suffixes'), ('frames', 'none of the supported suffixes'),
    ('nowhere/frames.svg', 'there is no folder')])
def test_file_that_cannot_be_is_one_sentence(bags, tmp_path, file, sentence):
    done = tool('tf_frames', '--bag', bags['well'], '-o', tmp_path / file)
    assert_one_sentence(done, 'tf_frames', sentence)
