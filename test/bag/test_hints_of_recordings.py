# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""No error, explanation or finding about a bag speaks of waiting for data."""

from argparse import Namespace
import json

from bags import LATCHED, Message, write_ros2
from failing_lookups import BEGIN, END, error_of, FAILING, moving, OF_LIVE_TREES, SECOND, STATIC
from patients import FAULTY, written
import pytest
from tf_tree_py.bag import BagWarning, open_bag
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.tools.archive.jobs import reported
from tf_tree_py.tools.recorded_tree import RecordedTree
from tool_helpers import tool


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    messages = [Message(BEGIN, '/tf_static', [
        (*each[:2], 0, tuple(each.pose)) for each in STATIC], LATCHED)]
    messages += [Message(BEGIN + 1_000_000 * number, '/tf', [(*each[:3], tuple(each.pose))])
                 for number, each in enumerate(moving())]
    return write_ros2(tmp_path_factory.mktemp('bags') / 'run', messages)


def of_live_trees(said):
    return {name: text for name, text in said.items() if OF_LIVE_TREES.search(text)}


def test_no_error_of_a_recording_speaks_of_waiting(bag):
    with pytest.warns(BagWarning, match='silent edge ended') as warned:
        recording = open_bag(bag)
    assert of_live_trees({'warning': str(warned[0].message)}) == {}
    said = {name: error_of(lookup, recording) for name, lookup in FAILING.items()}
    assert of_live_trees(said) == {}


def test_no_error_of_a_recording_with_a_window_speaks_of_waiting(bag):
    with pytest.warns(BagWarning):
        recording = open_bag(bag, cache_time=SECOND)
    text = error_of(lambda tree: tree.lookup('odom', 'base', BEGIN), recording)
    assert 'The buffer keeps 1.000 s: use a longer cache_time' in text
    assert not OF_LIVE_TREES.search(text)


@pytest.mark.parametrize(('frames', 'stamp'), [
    (('map', 'camera'), END + 1), (('map', 'camera'), END + 20 * SECOND),
    (('map', 'camera'), BEGIN), (('map', 'tree'), END), (('map', 'nowhere'), END),
    (('map', 'tree'), None), (('/map', 'camera'), None), (('pole', 'mast'), BEGIN + 20 * SECOND)])
def test_tf_echo_of_a_bag_does_not_speak_of_waiting(bag, frames, stamp):
    at = [] if stamp is None else ['--at', f'{stamp // SECOND}.{stamp % SECOND:09d}']
    for options in ([], ['--json'], ['--explain']):
        done = tool('tf_echo', *frames, '--bag', bag, *at, *options)
        assert done.returncode != 0
        assert not OF_LIVE_TREES.search(done.stdout + done.stderr), done.stdout + done.stderr


# --- the doctor


@pytest.mark.parametrize('code', FAULTY)
def test_no_fix_of_a_fault_in_a_bag_speaks_of_waiting(code, tmp_path):
    report = json.loads(tool('tf_doctor', '--bag', written(code, tmp_path), '--json').stdout)
    fixes = {finding['code']: finding['fix'] for finding in report['findings']}
    assert code in fixes and all(fixes.values())
    assert of_live_trees(fixes) == {}


def test_report_of_an_archive_has_the_fixes_of_a_recording(tmp_path):
    pytest.importorskip('jinja2')
    pages = reported(Thresholds(), written('delayed', tmp_path), 'run').files
    for page in pages.values():
        assert b'stamps_at_rate returns stamps' in page
        assert not OF_LIVE_TREES.search(CODES['delayed'].recorded_fix)
        assert b'timeout' not in page


def test_fixes_of_a_live_tree_are_those_of_the_catalogue(tmp_path):
    for code in ('delayed', 'clock_offset', 'static_late', 'skew'):
        doctor = Doctor()
        arguments = Namespace(bag=written(code, tmp_path), tf_topic=None, tf_static_topic=None)
        with RecordedTree(arguments, [doctor], doctor.limits.cache_time) as tree_input:
            tree_input.watch(None)
        assert {finding.fix for finding in doctor.findings() if finding.code == code} == {
            CODES[code].fix}
