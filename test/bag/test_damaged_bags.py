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

"""Of a bag that is damaged, what can be read is there, and one warning says what is missing."""

from bags import (
    assert_same,
    driving,
    fed,
    file_of,
    RUN,
    STATIC,
    without_index,
    write_ros1,
    write_ros2,
    write_split,
)
import pytest
from tf_tree_py.bag import BagWarning, open_bag


def warned(path, **options):
    """Open a bag that is odd; return the buffer and the one warning."""
    with pytest.warns(BagWarning) as told:
        buffer = open_bag(path, **options)
    assert len(told) == 1
    return buffer, str(told[0].message)


def cut(path, part=0.7):
    """Cut a file off."""
    data = path.read_bytes()
    path.write_bytes(data[:int(part * len(data))])
    return path


MANY = sorted(driving(count=4_000) + STATIC, key=lambda message: message.received)
CUT = {
    'mcap': lambda path: cut(file_of(write_ros2(path, MANY))),
    'mcap, chunks compressed':
        lambda path: cut(file_of(write_ros2(path, MANY, compression='storage'))),
    'mcap, messages compressed':
        lambda path: cut(file_of(write_ros2(path, MANY, compression='message'))),
    'mcap, in a folder': lambda path: cut(file_of(write_ros2(path, MANY))).parent,
    'sqlite3': lambda path: cut(file_of(write_ros2(path, MANY, 'sqlite3')), 0.5),
    'ros1': lambda path: cut(write_ros1(path.with_suffix('.bag'), MANY)),
    'ros1, lz4': lambda path: cut(write_ros1(path.with_suffix('.bag'), MANY, 'lz4')),
    'ros1, bz2': lambda path: cut(write_ros1(path.with_suffix('.bag'), MANY, 'bz2')),
}


@pytest.mark.parametrize('kind', CUT)
def test_of_a_bag_that_is_cut_off_what_can_be_read_is_there(tmp_path, kind):
    buffer, told = warned(CUT[kind](tmp_path / 'run'))
    print(told)
    taken = buffer.statistics.accepted
    assert 0.4 < taken / sum(len(message.transforms) for message in MANY) < 0.9
    first, count = [], 0
    for message in MANY:
        if count >= taken:
            break
        first.append(message)
        count += len(message.transforms)
    assert count == taken
    assert [edge._replace(authority='') for edge in buffer.edges()] == [
        edge._replace(authority='') for edge in fed(first).edges()]
    assert 'messages could be read' in told
    assert ('bytes could not' in told) == ('sqlite3' not in kind)


@pytest.mark.parametrize('write', [
    lambda path: file_of(write_ros2(path, RUN)),
    lambda path: file_of(write_ros2(path, RUN, compression='storage')),
    lambda path: write_ros1(path.with_suffix('.bag'), RUN),
], ids=['mcap', 'mcap, compressed', 'ros1'])
def test_bag_without_an_index_is_read_to_its_end(tmp_path, write):
    buffer, told = warned(without_index(write(tmp_path / 'run')))
    assert_same(buffer, fed(RUN))
    assert 'nothing is missing but its end with the index' in told


def test_missing_split_is_told_and_the_others_are_read(tmp_path):
    folder = write_split(tmp_path / 'run', [RUN[:100], RUN[100:200], RUN[200:]])
    (folder / 'run_1.mcap').unlink()
    buffer, told = warned(folder)
    assert 'run_1.mcap, which the index of the bag lists, is missing' in told
    assert_same(buffer, fed(RUN[:100] + RUN[200:]))


def test_folder_without_its_index_is_read_in_order_of_the_numbers(tmp_path):
    folder = write_split(tmp_path / 'run', [RUN[begin:begin + 30]
                                            for begin in range(0, len(RUN), 30)])
    (folder / 'metadata.yaml').unlink()
    assert_same(open_bag(folder), fed(RUN))


def ends(buffer):
    edge = next(edge for edge in buffer.edges() if edge.child == 'hand')
    return edge.oldest, edge.latest


@pytest.mark.parametrize('number', [0, 1])
def test_chunk_that_is_damaged_costs_no_more_than_itself(tmp_path, number):
    file = file_of(write_ros2(tmp_path / 'run', MANY, compression='storage'))
    data = bytearray(file.read_bytes())
    begin = data.index(b'zstd')
    if number:
        begin = data.index(b'zstd', begin + 10)
    data[begin + 12:begin + 412] = bytes(400)
    file.write_bytes(data)
    buffer, told = warned(file)
    kept = buffer.statistics.accepted / sum(len(message.transforms) for message in MANY)
    assert 0.2 < kept < 0.8
    (oldest, latest), whole = ends(buffer), ends(fed(MANY))
    assert ((oldest == whole[0]), (latest == whole[1])) == (number == 1, number == 0)
    assert 'run.mcap is damaged' in told and f'of {len(MANY)} messages could be read' in told


def test_mcap_of_another_tool_is_read_without_its_profile(tmp_path):
    file = file_of(write_ros2(tmp_path / 'run', RUN))
    file.write_bytes(file.read_bytes().replace(b'\x04\0\0\0ros2', b'\x04\0\0\0rosX', 1))
    buffer, told = warned(file)
    assert_same(buffer, fed(RUN))
    assert 'and nothing is missing' in told and 'index' not in told
