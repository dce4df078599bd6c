# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""One small bag for each code, and healthy ones, through the parts that tf_doctor uses."""

from argparse import Namespace

from bags import JAZZY, NOETIC, write_ros2
from patients import FAULTY, HEALTHY
import pytest
from tf_tree_py.core.arrivals.cursor import WireError
from tf_tree_py.core.arrivals.diagnostic_bytes import read_statuses
from tf_tree_py.core.checks.catalogue import CODES
from tf_tree_py.core.checks.finding import Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.vitals import gathering
from tf_tree_py.tools.source import open_source


def findings_of(messages, folder, seconds=None):
    """Return what a doctor finds in a bag of these messages, or in its first seconds."""
    bag = write_ros2(folder, sorted(messages, key=lambda message: message.received))
    arguments = Namespace(bag=bag, tf_topic=None, tf_static_topic=None, ros_arguments=[])
    doctor = Doctor()
    with open_source(arguments, 'test', [doctor], cache_time=doctor.limits.cache_time) as source:
        source.watch(seconds)
        doctor.endpoints = source.endpoints()
        return doctor.findings()


def worth_telling(findings):
    return {finding.code: finding.summary for finding in findings
            if finding.severity is not Severity.NOTE}


@pytest.mark.parametrize('name', HEALTHY)
def test_healthy_robot_is_left_alone(name, tmp_path):
    assert worth_telling(findings_of(HEALTHY[name](), tmp_path / 'bag')) == {}


@pytest.mark.parametrize('code', FAULTY)
def test_fault_is_found_and_nothing_else(code, tmp_path):
    findings = findings_of(FAULTY[code], tmp_path / 'bag')
    if CODES[code].severity is Severity.NOTE:
        assert worth_telling(findings) == {}
        assert code in {finding.code for finding in findings}
    else:
        assert list(worth_telling(findings)) == [code], worth_telling(findings)


@pytest.mark.parametrize('code', [
    'two_parents', 'two_publishers', 'static_changed', 'interpolated_jump', 'jump_back',
    'duplicate_stamps', 'out_of_order', 'pose_jump'])
def test_it_makes_no_difference_when_messages_are_looked_at(code, tmp_path, monkeypatch):
    """What stands on both sides of a border between two blocks is seen all the same."""
    monkeypatch.setattr(gathering, '_ENOUGH', 40)
    monkeypatch.setattr(gathering, '_OF_EACH', 1)
    found = worth_telling(findings_of(FAULTY[code], tmp_path / 'blocks'))
    monkeypatch.undo()
    assert list(found) == [code]
    if code != 'two_publishers':  # how large to and fro is, is an estimate
        assert found == worth_telling(findings_of(FAULTY[code], tmp_path / 'whole'))


def test_first_seconds_of_a_bag_are_its_own(tmp_path):
    assert worth_telling(findings_of(FAULTY['gap'], tmp_path / 'bag', seconds=2.0)) == {}


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
