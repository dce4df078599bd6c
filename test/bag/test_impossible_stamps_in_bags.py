# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recorded transforms whose stamp has a second or more of nanoseconds are refused one by one."""

from bags import (
    estimate,
    JAZZY,
    LATCHED,
    Message,
    ODOMETRY,
    SECOND,
    TF_MESSAGE,
    write_ros1,
    write_ros2,
)
from hypothesis import given, strategies as st
import numpy as np
import pytest
from serialized import serialize, serialize_ros1
from tf_tree_py import BufferCore
from tf_tree_py.bag import BagWarning, Connection, Decoder, open_bag, RecordedMessage
from tf_tree_py.bag.assembly.assembler import Assembler
from tf_tree_py.core import UNLIMITED
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.files.tree_file import saved_tree

BEGIN = 1_700_000_000
TF = Connection('/tf', TF_MESSAGE, False, '')
ONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

nanosecs = st.sampled_from([0, 5, SECOND - 1, SECOND, 2**32 - 1])


@given(st.lists(st.tuples(nanosecs, nanosecs), max_size=30))
def test_block_has_the_result_of_single_messages(pairs):
    arrivals = [RecordedMessage(0, TF, serialize([
        ('map', 'odom', number, first, ONE), ('odom', 'base', number, second, ONE)]))
        for number, (first, second) in enumerate(pairs)]
    together, buffer = Assembler(Decoder(), UNLIMITED), BufferCore(UNLIMITED)
    together.assemble(arrivals)
    for each in arrivals:
        buffer.insert_batch(Decoder().read(each), TF.authority)
    ours, theirs = saved_tree(together.tree), saved_tree(buffer.intake.tree)
    assert (ours.header, ours.as_bytes()) == (theirs.header, theirs.as_bytes())
    assert together.intake.statistics() == buffer.statistics()


@pytest.mark.parametrize(('write', 'bytes_of', 'name'), [
    (write_ros2, serialize, 'run'), (write_ros1, serialize_ros1, 'run.bag')],
    ids=['ROS 2', 'ROS 1'])
def test_oddity_names_the_edge_and_the_first_value(tmp_path, write, bytes_of, name):
    def message(number, nanosec, topic='/tf', qos=''):
        return Message((BEGIN + number) * SECOND, topic, [], qos, data=bytes_of(
            [('odom', f'base{topic[3:]}', BEGIN + number, nanosec, ONE)]))

    bag = write(tmp_path / name, [
        message(0, 2**32 - 1, '/tf_static', LATCHED),
        *(message(number, 2**32 - 1 if number in (4, 7) else number) for number in range(10))])
    with pytest.warns(BagWarning, match='impossible stamp'):
        recording = open_bag(bag)
    (oddity,) = recording.oddities
    assert (oddity.parent, oddity.child, oddity.times) == ('odom', 'base', 2)
    assert 'nanosec is 4294967295 (sec is 1700000004)' in oddity.detail
    assert recording.edges()[1].samples == 8
    assert recording.lookup('odom', 'base_static') == ONE


def test_impossible_stamp_of_an_odometry_is_refused_too(tmp_path):
    messages = [estimate('/odom', 'odom', 'base', (BEGIN + number) * SECOND, ONE, np.eye(6))
                for number in range(4)]
    said = JAZZY.deserialize_cdr(messages[2].data, ODOMETRY)
    said.header.stamp.nanosec = SECOND
    messages[2] = messages[2]._replace(data=bytes(JAZZY.serialize_cdr(said, ODOMETRY)))
    with pytest.warns(BagWarning, match='impossible stamp'):
        tree = open_bag(write_ros2(tmp_path / 'run', messages), odometry='/odom')
    assert tree.edges()[0].samples == 3
    assert tree.statistics.incidents[Kind.IMPOSSIBLE_STAMP] == 1
