# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One small bag for each code, and healthy ones, in the parts that tf_doctor uses."""

from argparse import Namespace

from bags import JAZZY, NOETIC, write_ros2
from patients import FAULTY, HEALTHY
import pytest
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures import sample_rows
from tf_tree_py.tools.recorded_tree import read_statuses
from tf_tree_py.tools.tree_source import open_source


def findings_of(messages, folder, seconds=None):
    """Return a doctor's findings in a bag of these messages, or in its first seconds."""
    bag = write_ros2(folder, sorted(messages, key=lambda message: message.received))
    arguments = Namespace(bag=bag, tf_topic=None, tf_static_topic=None, ros_arguments=[],
                          fleet=None, fleet_config=None)
    doctor = Doctor()
    with open_source(arguments, 'test', [doctor], cache_time=doctor.limits.cache_time) as source:
        source.watch(seconds)
        doctor.endpoints = source.endpoints()
        return doctor.findings()


def worth_reporting(findings):
    return {finding.code: finding.summary for finding in findings
            if finding.severity is not Severity.NOTE}


@pytest.mark.parametrize('name', HEALTHY)
def test_healthy_robot_is_left_alone(name, tmp_path):
    assert worth_reporting(findings_of(HEALTHY[name](), tmp_path / 'bag')) == {}


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
    monkeypatch.setattr(sample_rows, '_ENOUGH', 40)
    monkeypatch.setattr(sample_rows, '_OF_EACH', 1)
    found = worth_reporting(findings_of(FAULTY[code], tmp_path / 'blocks'))
    monkeypatch.undo()
    assert list(found) == [code]
    if code != 'two_publishers':  # the distance that it reports is an estimate
        assert found == worth_reporting(findings_of(FAULTY[code], tmp_path / 'whole'))


def test_first_seconds_of_a_bag_are_its_own(tmp_path):
    assert worth_reporting(findings_of(FAULTY['gap'], tmp_path / 'bag', seconds=2.0)) == {}


def test_there_is_a_bag_for_every_code():
    assert list(FAULTY) == list(CODES)


@pytest.mark.parametrize('ros1', [False, True])
def test_diagnostics_of_both_ros_are_read_and_what_breaks_off_is_told(ros1):
    store, more = (NOETIC, {'seq': 0}) if ros1 else (JAZZY, {})
    array, status, header, time, pair = (store.types[name] for name in (
        'diagnostic_msgs/msg/DiagnosticArray', 'diagnostic_msgs/msg/DiagnosticStatus',
        'std_msgs/msg/Header', 'builtin_interfaces/msg/Time', 'diagnostic_msgs/msg/KeyValue'))
    message = array(header(**more, stamp=time(1, 2), frame_id='odd'), [
        status(2, 'first', 'm', 'hw', [pair('key', 'value'), pair('', 'äöü')]),
        status(0, 'second', '', '', [])])
    write = store.serialize_ros1 if ros1 else store.serialize_cdr
    data = bytes(write(message, array.__msgtype__))
    assert list(read_statuses(data, ros1)) == [
        ('first', {'key': 'value', '': 'äöü'}), ('second', {})]
    for size in range(len(data) - 4):
        with pytest.raises(WireError):
            list(read_statuses(data[:size], ros1))
