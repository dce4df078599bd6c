# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One small bag for each code, and healthy ones, in the parts that tf_doctor uses."""

from argparse import Namespace

from bags import SECOND, write_ros1, write_ros2
from patients import FAULTY, HEALTHY
import pytest
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.checks.graph import GRAPH_CODES
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures import sample_rows
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.tools.tree_input import open_input


def opened(messages, folder, observers, write=write_ros2):
    """Write these messages to a bag, and return it as the input of a tool."""
    bag = write(folder, sorted(messages, key=lambda message: message.received))
    arguments = Namespace(bag=bag, tf_topic=None, tf_static_topic=None, ros_arguments=[],
                          fleet=None, fleet_config=None)
    return open_input(arguments, 'test', observers, cache_time=Thresholds().cache_time)


def findings_of(messages, folder, seconds=None):
    """Return a doctor's findings in a bag of these messages, or in its first seconds."""
    doctor = Doctor()
    with opened(messages, folder, [doctor]) as tree_input:
        tree_input.watch(seconds)
        doctor.endpoints = tree_input.endpoints()
        return doctor.findings()


def worth_reporting(findings):
    return {finding.code: finding.summary for finding in findings
            if finding.severity is not Severity.NOTE}


@pytest.mark.parametrize('name', HEALTHY)
def test_healthy_robot_is_left_alone(name, tmp_path):
    assert worth_reporting(findings_of(HEALTHY[name](), tmp_path / 'bag')) == {}


@pytest.mark.parametrize('write', [write_ros1, write_ros2])
def test_time_of_a_recording_is_that_of_its_clock(write, tmp_path):
    messages = HEALTHY['simulation']()
    if write is write_ros1:  # it has no encapsulation, and a Time no seq, unlike a header
        messages = [message._replace(data=message.data[4:]) if message.topic == '/clock'
                    else message for message in messages]
    with opened(messages, tmp_path / 'run.bag', [], write) as tree_input:
        tree_input.watch(None)
        newest = max(stamp for message in messages for *_, stamp, _ in message.transforms)
        assert newest <= tree_input.now() < newest + SECOND


@pytest.mark.parametrize('code', FAULTY)
def test_fault_is_found_and_nothing_else(code, tmp_path):
    findings = findings_of(FAULTY[code], tmp_path / 'bag')
    if CODES[code].severity is Severity.NOTE:
        assert worth_reporting(findings) == {}
        assert code in {finding.code for finding in findings}
    else:
        assert list(worth_reporting(findings)) == [code], worth_reporting(findings)


@pytest.mark.parametrize('code', [
    'two_parents', 'two_publishers', 'static_changed', 'interpolated_jump', 'jump_back',
    'duplicate_stamps', 'out_of_order', 'pose_jump'])
def test_it_makes_no_difference_when_messages_are_looked_at(code, tmp_path, monkeypatch):
    """A fault across the border between two blocks is also detected."""
    monkeypatch.setattr(sample_rows, 'ENOUGH', 40)
    monkeypatch.setattr(sample_rows, 'OF_EACH', 1)
    found = worth_reporting(findings_of(FAULTY[code], tmp_path / 'blocks'))
    monkeypatch.undo()
    assert list(found) == [code]
    if code != 'two_publishers':  # the distance that it reports is an estimate
        assert found == worth_reporting(findings_of(FAULTY[code], tmp_path / 'whole'))


def test_first_seconds_of_a_bag_are_its_own(tmp_path):
    assert worth_reporting(findings_of(FAULTY['gap'], tmp_path / 'bag', seconds=2.0)) == {}


def test_there_is_a_bag_for_every_code_that_a_bag_can_show():
    assert FAULTY.keys() == CODES.keys() - GRAPH_CODES, (
        'FAULTY of test/tools/patients.py needs a robot for each code of CHECKS in catalogue.py '
        'that a bag can show, in the same order')


def test_diagnostics_that_break_off_are_passed_over(tmp_path):
    first, second = (message for message in FAULTY['source_silent']
                     if message.topic == '/diagnostics')
    others = [message for message in FAULTY['source_silent'] if message.topic != '/diagnostics']
    broken = first._replace(data=first.data[:-20])
    for messages, found in (([broken], False), ([broken, second], True)):
        findings = worth_reporting(findings_of([*others, *messages], tmp_path / str(found)))
        assert ('source_silent' in findings) is found
