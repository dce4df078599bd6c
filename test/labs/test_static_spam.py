# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A calibration sent like a moving edge: its cost, and the errors when its sender dies."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core.messages.wire import WireReader
from tf_tree_py.labs.static_spam import CHILD, message, PARENT, POSE


def test_message_is_what_comes_off_the_wire():
    [sample] = WireReader().read(message(1_234_567_890)).samples()
    assert sample == (PARENT, CHILD, 1_234_567_890, POSE)


def test_message_is_as_ros_serializes_it():
    serialization = pytest.importorskip('rclpy.serialization')
    messages = pytest.importorskip('tf2_msgs.msg')
    convert = pytest.importorskip('tf_tree_py.ros.messages.convert')
    data = serialization.serialize_message(messages.TFMessage(transforms=[
        convert.transform_stamped(PARENT, CHILD, 1_234_567_890, POSE)]))
    # Except for the padding, which may contain anything.
    assert len(data) == len(message(1_234_567_890))
    assert WireReader().read(data).samples() == WireReader().read(message(1_234_567_890)).samples()


def test_spam_is_a_thousand_times_the_messages():
    spam, once = rows_of('static-spam')
    assert (spam['messages'], once['messages']) == (10_000, 10)
    assert spam['payload_bytes'] == 1000 * once['payload_bytes'] == 10_000 * len(message(0))
    assert (spam['samples'], once['samples']) == (10_000, 10)


def test_stamped_lookup_fails_where_the_latest_is_wrong():
    for row in rows_of('static-spam', 1):
        assert row['moving_stamped'] == 'FutureExtrapolation'
        if row['after_s'] < 10.0:
            assert row['moving_latest'] == pytest.approx(0.5 * row['after_s'], abs=1e-6)
        else:
            assert row['moving_latest'] == 'PastExtrapolation'


def test_static_is_right_for_ever():
    for row in rows_of('static-spam', 1):
        assert row['static_stamped'] == row['static_latest'] == pytest.approx(0.0, abs=1e-9)
    assert report_of('static-spam').numbers['messages_ratio'] == 1000
