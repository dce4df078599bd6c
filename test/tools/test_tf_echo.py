# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_echo: its results, explanations and errors, on a bag."""

import json
import math

from bags import estimate, LATCHED, Message, START, write_ros2
import numpy as np
from patients import HEALTHY
import pytest
from tf_tree_py.core import Pose
from tool_helpers import assert_one_sentence, assert_shape, tool


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_ros2(tmp_path_factory.mktemp('echo') / 'bag', sorted(
        HEALTHY['warehouse_robot'](), key=lambda message: message.received))


def test_answers_come_at_a_rate_of_recorded_time(bag):
    done = tool('tf_echo', 'map', 'lidar', '--bag', bag)
    lines = done.stdout.splitlines()
    assert (done.returncode, len(lines)) == (0, 9)
    assert lines[3].startswith('1700000003.500000000  age      4.3 ms  xyz  ')
    many = tool('tf_echo', 'map', 'lidar', '--bag', bag, '--rate', '10').stdout
    assert len(many.splitlines()) > 75
    assert tool('tf_echo', 'map', 'lidar', '10', '--bag', bag).stdout == many  # as in tf2_echo


def test_explanation_has_the_path_and_each_edge(bag):
    done = tool('tf_echo', 'map', 'lidar', '--bag', bag, '--at', '1700000003.333', '--explain',
                '--as', 'all')
    assert done.returncode == 0
    assert '1.000000' in done.stdout and 'rad)' in done.stdout
    assert 'map <- odom <- base_link <- lidar' in done.stdout
    edge, = (line for line in done.stdout.splitlines() if line.startswith(' odom -> base_link'))
    assert edge.split()[3:] == ['50.0', 'Hz', '4.5', 'ms', '-13.0', '+7.0', 'ms', '2.1', 'cm',
                                '0.2°', '-']
    assert done.stdout.splitlines()[-1] == (
        'noise of the samples: odom -> base_link 0 mm 0°; map -> odom 0.36 mm 0.007°')


def test_json_has_the_documented_shape_with_and_without_an_answer(bag):
    for frames, status in ((('map', 'lidar'), 0), (('map', 'nowhere'), 1)):
        done = tool('tf_echo', *frames, '--bag', bag, '--once', '--json')
        assert done.returncode == status
        answer = json.loads(done.stdout)
        assert_shape(answer, 'tools', '### An answer of tf_echo')
        for edge in answer['edges']:
            assert_shape(edge, 'tools', '### An edge of an answer')
        assert bool(answer['edges']) is (status == 0)


@pytest.fixture(scope='module')
def uncertain_bag(tmp_path_factory):
    """Return the same, with errors of the lidar: 1 cm along each axis, 2 degrees."""
    turn = math.radians(2.0) ** 2
    told = [estimate('/tf_static_covariance', 'base_link', child, START, Pose(),
                     np.diag([1e-4, 1e-4, 1e-4, 0.0, 0.0, rotation]), qos=LATCHED)
            for child, rotation in (('lidar', turn), ('camera', -1.0))]
    return write_ros2(tmp_path_factory.mktemp('echo') / 'bag', sorted(
        [*HEALTHY['warehouse_robot'](), *told], key=lambda message: message.received))


def test_recorded_covariances_of_static_edges_are_told(uncertain_bag, bag):
    question = 'tf_echo', 'map', 'lidar', '--once', '--bag'
    done = tool(*question, uncertain_bag, '--explain')
    assert done.stdout.splitlines()[-1] == (
        'sigma 1 cm, 2°: base_link -> lidar 100% of position, 100% of rotation')
    assert 'sigma' not in tool(*question, uncertain_bag).stdout
    assert 'sigma' not in tool(*question, bag, '--explain').stdout
    uncertainty = json.loads(tool(*question, uncertain_bag, '--json').stdout)['uncertainty']
    assert_shape(uncertainty, 'tools', '### The uncertainty of an answer')
    assert (uncertainty['sigma_m'], uncertainty['sigma_deg']) == pytest.approx((0.01, 2.0))
    assert np.shape(uncertainty['covariance']) == (6, 6)
    # "These topics and no others."
    alone = tool(*question, uncertain_bag, '--json', '--tf-topic', '/tf',
                 '--tf-static-topic', '/tf_static')
    assert json.loads(alone.stdout)['uncertainty'] is None


@pytest.mark.parametrize('arguments, told', [
    (['mapp', 'lidr'], ["'mapp': did you mean 'map'?", "'lidr': did you mean 'lidar'?",
                        'known frames: lidar, base_link']),
    (['map', 'lidar', '--at', '1800000000'],
     ['odom -> base_link', 'ended 99999992.020 s before the requested stamp'])])
def test_what_is_missing_is_told_and_is_a_status(bag, arguments, told):
    done = tool('tf_echo', *arguments, '--once', '--bag', bag)
    assert (done.returncode, done.stderr) == (1, '')
    assert all(text in done.stdout for text in told)


def test_hint_is_a_line_of_its_own(tmp_path):
    two_trees = write_ros2(tmp_path / 'bag', [
        Message(START, '/tf', [('a', 'b', START, Pose()), ('c', 'd', START, Pose())])])
    sentence, hint = tool('tf_echo', 'a', 'd', '--once', '--bag', two_trees).stdout.splitlines()
    assert sentence.startswith("no answer for a <- d: Could not find a connection between 'a'")
    assert hint.startswith('  Tf has two or more unconnected trees')


@pytest.mark.parametrize('arguments, sentence', [
    (['/map', 'lidar'], "'/map' begins with a slash"),
    (['map', ''], "'' is not a frame name"),
    (['map', 'lidar', '--at', 'nan'], "'nan' is not a stamp"),
    (['map', 'lidar', '--at', '1e999999999'], "'1e999999999' is not a stamp"),
    (['map', 'lidar', '--rate', '0'], "'0' is not a number greater than zero"),
    (['map', 'lidar', '--rate', '1e-300'], "'1e-300' is not a number from 1e-9 to 1e9"),
    (['map', 'lidar', '--seconds', '1e300'], "'1e300' is not a number from 1e-9 to 1e9"),
    (['map', 'lidar', '10', '--rate', '5'], '10 and --rate 5: give one rate'),
    (['map', 'lidar', 'base'], "'base' is not a number"),
    (['map', 'lidar', '--max-age', '0'], "'0' is not a number greater than zero"),
    (['map', 'lidar', '--max-age', '1', '--at', '3'],
     '--max-age concerns the present, and not --at: omit one of them'),
    (['map', 'lidar', '--max-age', '1', '--bag', 'nowhere'],
     '--max-age concerns the present, and not --bag: omit one of them'),
    (['map', 'lidar', '--bag', 'nowhere'], 'nowhere')])
def test_what_cannot_be_asked_is_one_sentence(arguments, sentence):
    assert_one_sentence(tool('tf_echo', *arguments), 'tf_echo', sentence)
