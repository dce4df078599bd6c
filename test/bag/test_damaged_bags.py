# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All readable parts of a damaged bag are read, and one warning describes the missing ones."""

from contextlib import closing
import re
import shutil
import sqlite3
import warnings

from bags import (
    assert_same,
    driving,
    fed,
    file_of,
    Message,
    RUN,
    STATIC,
    without_index,
    write_mcap,
    write_ros1,
    write_ros2,
    write_split,
)
from counting import calls
from effort import examples
from hypothesis import example, given, HealthCheck, strategies as st
import pytest
from rosbags.rosbag2 import storage_mcap
from tf_tree_py.bag import BagError, BagWarning, open_bag
from tf_tree_py.bag.files import connections, rosbags_file
from tf_tree_py.bag.files.connections import Connection
from tf_tree_py.bag.files.mcap_scan import McapScan
from tf_tree_py.bag.files.scanning import Bytes
from tf_tree_py.bag.files.unpacking import zstd
from tf_tree_py.core.stamp import format_stamp


def warned(path, **options):
    """Open a bag with a problem; return the buffer and the single warning."""
    with pytest.warns(BagWarning) as told:
        buffer = open_bag(path, **options)
    assert len(told) == 1
    return buffer, str(told[0].message)


def cut(path, part=0.7):
    """Truncate a file."""
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


@pytest.mark.parametrize('form', CUT)
def test_of_a_bag_that_is_cut_off_what_can_be_read_is_there(tmp_path, form):
    buffer, told = warned(CUT[form](tmp_path / 'run'))
    print(told)
    taken = buffer.statistics.accepted
    assert 0.4 < taken / sum(len(message.transforms) for message in MANY) < 0.9
    stamps = {edge.child: set(buffer.stamps_of(edge.child).tolist()) for edge in buffer.edges()}
    there = [message for message in MANY
             if message in STATIC or message.transforms[0][2] in stamps[message.transforms[0][1]]]
    assert sum(len(message.transforms) for message in there) == taken
    assert [edge._replace(authority='') for edge in buffer.edges()] == [
        edge._replace(authority='') for edge in fed(there).edges()]
    # It depends on the version of SQLite whether pages are in the order of the messages.
    assert form == 'sqlite3' or there == MANY[:len(there)]
    assert 'messages could be read' in told
    assert ('bytes could not' in told) == ('sqlite3' not in form)


@pytest.mark.parametrize('write', [
    lambda path: file_of(write_ros2(path, RUN)),
    lambda path: file_of(write_ros2(path, RUN, compression='storage')),
    lambda path: write_ros1(path.with_suffix('.bag'), RUN),
], ids=['mcap', 'mcap, compressed', 'ros1'])
def test_bag_without_an_index_is_read_to_its_end(tmp_path, write):
    buffer, told = warned(without_index(write(tmp_path / 'run')))
    assert_same(buffer, fed(RUN))
    assert 'nothing is missing except the index at its end' in told
    assert 'is not whole' not in told


def test_missing_split_is_told_and_the_others_are_read(tmp_path):
    folder = write_split(tmp_path / 'run', [RUN[:100], RUN[100:200], RUN[200:]])
    (folder / 'run_1.mcap').unlink()
    buffer, told = warned(folder)
    assert 'run_1.mcap, which the index or a log in the folder names, is missing' in told
    assert_same(buffer, fed(RUN[:100] + RUN[200:]))


@pytest.fixture
def killed(tmp_path):
    """Return the file of a recorder that was killed: most of its rows are in SQLite's log."""
    file = file_of(write_ros2(tmp_path / 'run', RUN, 'sqlite3'))
    with closing(sqlite3.connect(file)) as recorder:
        recorder.execute('PRAGMA journal_mode = WAL')
        rows = recorder.execute('SELECT * FROM messages WHERE id > 50').fetchall()
        recorder.execute('DELETE FROM messages WHERE id > 50')
        recorder.commit()
        recorder.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        recorder.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows)
        recorder.commit()
        for each in (file, file.with_name(file.name + '-wal')):
            shutil.copyfile(each, tmp_path / each.name)
    return tmp_path / file.name


def test_rows_in_the_log_of_sqlite_are_read(killed):
    before = killed.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert_same(open_bag(killed), fed(RUN))
    assert killed.read_bytes() == before


def test_log_of_sqlite_without_its_file_is_damage(killed):
    killed.unlink()
    with pytest.raises(BagError, match=f'only {killed.name}-wal, the log of one that is missing'):
        open_bag(_folder(killed))
    write_ros2(killed.parent / 'other', RUN[:50])
    file = file_of(killed.parent / 'other')
    shutil.copyfile(file, _folder(killed) / file.name)
    _, told = warned(_folder(killed))
    assert f'{killed.name}, which the index or a log in the folder names, is missing' in told


def _folder(killed):
    """Return a folder with only the log."""
    folder = killed.parent / 'left'
    folder.mkdir(exist_ok=True)
    shutil.copyfile(f'{killed}-wal', folder / f'{killed.name}-wal')
    return folder


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
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert_same(open_bag(file), fed(RUN))
    _, warning = warned(cut(file))
    assert 'run.mcap is not whole: ' in warning


# --- no overstatement, no exception, no excessive memory

@pytest.mark.parametrize('form', CUT)
def test_no_more_is_said_to_be_lost_than_there_is(tmp_path, form):
    _, told = warned(CUT[form](tmp_path / 'run'))
    for lost, size in re.findall(r'and ([0-9,]+) of its ([0-9,]+) bytes could not', told):
        # All of the file except a piece of its last message is read.
        assert int(lost.replace(',', '')) < 0.1 * int(size.replace(',', ''))


def test_times_of_what_could_be_read_are_told(tmp_path):
    _, told = warned(CUT['mcap'](tmp_path / 'run'))
    assert f'received from {format_stamp(MANY[0].received)} to ' in told


SMALL = sorted(driving(count=40) + STATIC, key=lambda message: message.received)
WHOLE = {
    'mcap': lambda path: file_of(write_ros2(path, SMALL)),
    'mcap, compressed': lambda path: file_of(write_ros2(path, SMALL, compression='storage')),
    'sqlite3': lambda path: file_of(write_ros2(path, SMALL, 'sqlite3')),
    'ros1': lambda path: write_ros1(path.with_suffix('.bag'), SMALL),
}


@pytest.fixture(scope='module', params=WHOLE)
def whole(request, tmp_path_factory):
    """Return an undamaged file, and its bytes."""
    file = WHOLE[request.param](tmp_path_factory.mktemp('whole') / 'run')
    return file, file.read_bytes()


@examples(0.4, suppress_health_check=[HealthCheck.too_slow])
@given(places=st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)),
                       min_size=1, max_size=3))
@example(places=[(0.0703125, 28)])  # SQLite repeats this control character in its error.
@example(places=[(0.845395709212012, 0)])  # In the compressed MCAP file, a topic has no type.
def test_whatever_bytes_are_damaged_it_is_a_bag_or_one_sentence(whole, places):
    file, data = whole
    damaged = bytearray(data)
    for part, value in places:
        damaged[int(part * len(damaged))] = value
    other = file.with_name(f'damaged{file.suffix}')
    other.write_bytes(damaged)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', BagWarning)
        try:
            assert isinstance(open_bag(other).frames(), list)
        except BagError as error:
            assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize('type_name', ['', 'TFMessage', '/'])
def test_topic_whose_type_is_damaged_has_no_transforms(type_name):
    connection = Connection('/tf', type_name, False, '')
    assert not connection.has_transforms and not connection.has_static_covariances


def test_length_of_a_record_that_no_memory_can_hold_is_damage(tmp_path):
    file = file_of(write_ros2(tmp_path / 'run', SMALL))
    data = bytearray(file.read_bytes())
    first = len(b'\x89MCAP0\r\n')
    data[first + 1:first + 9] = (2**60).to_bytes(8, 'little')
    file.write_bytes(data)
    with pytest.raises(BagError), warnings.catch_warnings():
        warnings.simplefilter('error')
        open_bag(file)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_quality_of_service_that_is_no_yaml_costs_nothing_else(tmp_path, storage):
    file = file_of(write_ros2(tmp_path / 'run', SMALL, storage))
    # The lengths are unchanged.
    file.write_bytes(file.read_bytes().replace(b'history: ', b'his{ory: '))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', BagWarning)
        assert open_bag(file).frames() == fed(SMALL).frames()


def test_file_that_unpacks_to_a_thousand_times_its_size_is_refused(
        tmp_path, monkeypatch):
    monkeypatch.setattr(connections, 'ALWAYS', 2**20)
    file = tmp_path / 'zeros.db3.zstd'
    file.write_bytes(zstd.compress(bytes(8 * 2**20)))
    with pytest.raises(BagError, match='unpacks to more than 1,048,576; TF_TREE_PY_MAX_UNPACKED'):
        open_bag(file)
    monkeypatch.setenv('TF_TREE_PY_MAX_UNPACKED', str(2**30))
    with pytest.raises(BagError) as told:
        open_bag(file)
    assert 'unpacks to' not in str(told.value)


def test_chunk_that_unpacks_to_more_than_the_limit_is_left_out(tmp_path, monkeypatch):
    file = file_of(write_ros2(tmp_path / 'run', MANY, compression='storage'))
    whole = len(fed(MANY).frames())
    monkeypatch.setenv('TF_TREE_PY_MAX_UNPACKED', '1000')
    with pytest.raises(BagError, match='unpacks to more than 1,000'):
        open_bag(file)
    monkeypatch.delenv('TF_TREE_PY_MAX_UNPACKED')
    assert len(open_bag(file).frames()) == whole


ZEROS = bytes(8 * 2**20)
FEW = sorted(driving(count=40), key=lambda message: message.received)


@pytest.mark.parametrize('frames', [1, 2])
def test_mcap_chunk_that_says_that_it_is_small_is_not_unpacked_whole(frames):
    """Rosbags refuses a chunk of another size than its header's; that must also take little."""
    packed = zstd.compress(ZEROS) * frames
    assert len(packed) < 2000
    assert len(storage_mcap.DECOMPRESSORS['zstd'](packed, 1000)) == 1001
    honest = zstd.compress(b'transforms') * frames
    assert storage_mcap.DECOMPRESSORS['zstd'](honest, 10 * frames) == b'transforms' * frames


@pytest.mark.parametrize('compression', ['lz4', 'zstd'])
def test_mcap_of_either_compression_is_read(tmp_path, compression):
    file = write_mcap(tmp_path / 'run.mcap', FEW, compression)
    assert open_bag(file).statistics.accepted == sum(len(each.transforms) for each in FEW)


@pytest.mark.parametrize('compression', ['lz4', 'zstd'])
@pytest.mark.parametrize('said', [1000, 2**20, 2**50])
def test_mcap_chunk_whose_header_lies_about_its_size_is_left_out(
        tmp_path, monkeypatch, compression, said):
    huge = Message(FEW[-1].received + 1, '/tf', [], data=ZEROS)
    file = write_mcap(tmp_path / 'run.mcap', [*FEW, huge], compression)
    # The size in the chunk's header and in the index, but not the one in an lz4 frame.
    size = len(ZEROS) + 31
    file.write_bytes(re.sub(b'(?<!\x04\x22\x4d\x18..)' + re.escape(size.to_bytes(8, 'little')),
                            said.to_bytes(8, 'little'), file.read_bytes(), flags=re.DOTALL))
    assert file.stat().st_size < len(ZEROS) / 100
    monkeypatch.setattr(connections, 'ALWAYS', 2**20)
    sizes, unpack = [], rosbags_file.unpacked_up_to

    def noted(*arguments):
        unpacked = unpack(*arguments)
        sizes.append(len(unpacked))
        return unpacked

    monkeypatch.setattr(rosbags_file, 'unpacked_up_to', noted)
    buffer, told = warned(file)
    assert 'Chunk size mismatch' in told or 'unpacks to more than ' in told
    assert max(sizes, default=0) <= min(said, 2**20) + 1
    assert buffer.statistics.accepted == sum(len(each.transforms) for each in FEW)


def test_chunk_of_zeros_is_not_looked_through(tmp_path):
    """Records of kind 0 are skipped: a chunk that unpacks to 8 MB of them takes no time."""
    file = write_mcap(tmp_path / 'run.mcap', FEW, 'none')
    data = file.read_bytes()
    file.write_bytes(data[:len(data) // 2] + ZEROS)
    scan = McapScan(file)
    with calls() as of:
        list(scan)
        assert 0 < of(Bytes.read) < 10_000


def test_rosbags_without_a_place_for_the_limit_is_warned_of():
    with pytest.warns(RuntimeWarning, match=r'rosbags [0-9.]+ has no place for a limit on chunks '
                      'of MCAP.*TF_TREE_PY_MAX_UNPACKED has no effect'):
        rosbags_file.limit_mcap(None)


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
def test_ros1_chunk_that_unpacks_to_more_than_the_limit_is_left_out(
        tmp_path, monkeypatch, compression):
    huge = Message(MANY[-1].received + 1, '/tf', [], data=ZEROS)
    file = write_ros1(tmp_path / 'run.bag', [*MANY[:10], huge], compression)
    assert file.stat().st_size < len(ZEROS) / 100
    monkeypatch.setattr(connections, 'ALWAYS', 2**20)
    buffer, told = warned(file)
    assert 'unpacks to more than ' in told and 'TF_TREE_PY_MAX_UNPACKED' in told
    assert buffer.frames() == []
