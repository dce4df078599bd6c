# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_monitor: every edge of a bag, problems first."""

import itertools
import json
import re

from bags import write_ros2
import numpy as np
from patients import FAULTY, HEALTHY
import pytest
from tf_tree_py import BufferCore, Pose
from tool_helpers import assert_one_sentence, assert_shape, tool


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('monitor')
    return {name: write_ros2(folder / name, sorted(messages, key=lambda each: each.received))
            for name, messages in (('well', HEALTHY['warehouse_robot']()),
                                   ('loop', FAULTY['loop']), ('gap', FAULTY['gap']))}


def rows(done):
    """Return the cells of the table."""
    lines = done.stdout.splitlines()
    rule = next(number for number, line in enumerate(lines) if '───' in line)
    return [line.split() for line in itertools.takewhile(str.strip, lines[rule + 1:])]


def test_trouble_comes_first_and_statics_last(bags):
    done = tool('tf_monitor', '--bag', bags['loop'])
    assert done.returncode == 1
    first, *others = rows(done)
    assert first[:4] == ['!!', 'tool', '->', 'base_link']
    assert first[9] == '25'
    edge, numbers = others[0][:3], [float(others[0][column]) for column in (3, 5, 6, 7)]
    assert edge == ['base_link', '->', 'arm'] and others[0][8:] == ['-']
    assert numbers == pytest.approx([50.0, 4.25, 4.5, 20.0], abs=0.06)
    assert [row[-2] for row in others[-2:]] == ['static', 'static']
    assert 'error loop  tool, base_link' in done.stdout


def test_chain_shows_its_edges_only(bags):
    done = tool('tf_monitor', 'map', 'lidar', '--bag', bags['gap'])
    assert done.returncode == 0
    assert [row[:4] for row in rows(done)] == [
        ['!', 'odom', '->', 'base_link'], ['map', '->', 'odom', '20.0'],
        ['base_link', '->', 'lidar', 'static']]
    assert 'refused' not in done.stdout
    missing = tool('tf_monitor', 'map', 'lidr', '--bag', bags['gap'])
    assert "\nDid you mean 'lidar'" in missing.stdout and '\\n' not in missing.stdout


@pytest.fixture(scope='module')
def trembling(tmp_path_factory):
    """Return a bag with an edge that has noise of 2 mm, and one that is too short to say."""
    rng, buffer = np.random.default_rng(1), BufferCore()
    for stamp in range(10**9, 6 * 10**9, 20_000_000):
        buffer.insert('odom', 'base', stamp, Pose(x=1e-9 * stamp + rng.normal(scale=0.002)))
    buffer.insert('base', 'arm', 6 * 10**9, Pose())
    buffer.insert('base', 'lidar', 0, Pose(z=1.0), static=True)
    path = tmp_path_factory.mktemp('trembling') / 'bag.mcap'
    buffer.record(path)
    return path


def test_noise_is_shown_where_it_is_known(trembling):
    assert 'noise' not in tool('tf_monitor', '--bag', trembling).stdout
    done = tool('tf_monitor', '--bag', trembling, '--noise')
    shown = {row[row.index('->') + 1]: ' '.join(row) for row in rows(done)}
    assert re.search(r' (1\.[89]|2|2\.[123]) mm 0° -$', shown['base'])
    assert 'mm' not in shown['arm'] + shown['lidar']
    look = json.loads(tool('tf_monitor', '--bag', trembling, '--noise', '--json').stdout)
    noise = {edge['child']: edge['noise'] for edge in look['edges']}
    assert noise['base']['sigma_m'] == pytest.approx(0.002, rel=0.15)
    assert noise['base']['trials'] > 100 and noise['arm'] is noise['lidar'] is None


@pytest.mark.parametrize('name', ['well', 'loop'])
def test_json_has_the_documented_shape(bags, name):
    look = json.loads(tool('tf_monitor', '--bag', bags[name], '--json').stdout)
    assert_shape(look, 'tools', '### A look of tf_monitor')
    for edge in look['edges']:
        assert_shape(edge, 'tools', '### An edge of a look')
    worst = look['edges'][0]
    assert (worst['severity'], worst['codes'], worst['refused']) == (
        ('error', ['loop'], 25) if name == 'loop' else (None, [], 0))


def test_chain_with_one_end_is_one_sentence(bags):
    assert_one_sentence(tool('tf_monitor', 'map', '--bag', bags['well']), 'tf_monitor',
                        'both frames')
