# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rows in the log of a recorder that was killed are read, also if its file is damaged."""

from contextlib import closing
from functools import cache
from pathlib import Path
import shutil
import sqlite3
import struct
from tempfile import TemporaryDirectory

from bags import as_cdr, driving, file_of, missing_rows, RUN, STATIC, write_ros2
from effort import examples
from hypothesis import given, strategies as st
import pytest
from tf_tree_py.bag import BagError
from tf_tree_py.bag.files.bag_reader import Bag
from tf_tree_py.bag.files.sqlite_scan import SqliteScan

PAGE = 4096
MANY = sorted(driving(count=2_000) + STATIC, key=lambda message: message.received)
# Four times as long as a page of 512 bytes.
LONG = [message._replace(transforms=message.transforms * 10) for message in driving(count=400)]
RECORDINGS = {'run': RUN, 'many': MANY, 'long': LONG}


@cache
def file_and_log(recording, page, at_once):
    """
    Return the bytes of a file whose last rows, which repeat all messages, are in its log.

    :param at_once: the number of rows in a transaction.
    :return: those of the file, and those of the log.
    """
    messages = RECORDINGS[recording]
    with TemporaryDirectory() as folder:
        file = file_of(write_ros2(Path(folder) / 'run', messages, 'sqlite3'))
        with closing(sqlite3.connect(file)) as recorder:
            recorder.execute(f'PRAGMA page_size = {page}')
            recorder.execute('VACUUM')
            recorder.execute('PRAGMA journal_mode = WAL')
            recorder.execute('PRAGMA wal_checkpoint(TRUNCATE)')
            recorder.execute('PRAGMA wal_autocheckpoint = 0')
            for begin in range(0, len(messages), at_once):
                recorder.execute(
                    f'INSERT INTO messages SELECT id + {len(messages)}, topic_id, timestamp + '
                    '1000000000, data FROM messages WHERE id > ? AND id <= ?',
                    [begin, min(begin + at_once, len(messages))])
                recorder.commit()
            return file.read_bytes(), Path(f'{file}-wal').read_bytes()


def file_with_log(path, recording='run', page=PAGE, at_once=10**6):
    """Write the file of a recorder that was killed, and its log; see ``file_and_log``."""
    folder = path / 'killed'
    folder.mkdir()
    file = folder / 'run.db3'
    for name, data in zip((file, f'{file}-wal'), file_and_log(recording, page, at_once),
                          strict=True):
        Path(name).write_bytes(data)
    return file


@cache
def data_of(recording):
    """Return the data of the messages."""
    return frozenset(as_cdr(message.transforms) for message in RECORDINGS[recording])


@pytest.fixture
def killed(tmp_path):
    """Return the file of a recorder that was killed."""
    return file_with_log(tmp_path)


@pytest.mark.parametrize('part', [0.35, 0.4, 0.45, 0.6, 0.7123, 0.9, 0.99])
@pytest.mark.parametrize('recording, page', [('run', PAGE), ('many', 2**16), ('long', 512)])
def test_rows_in_the_log_of_a_truncated_file_are_read(tmp_path, recording, page, part):
    file, messages = file_with_log(tmp_path, recording, page), RECORDINGS[recording]
    whole = file.read_bytes()
    file.write_bytes(whole[:int(part * len(whole))])
    with Bag(file) as bag:
        given = [arrival.data for connection in bag.everything
                 for arrival in bag.messages(connection.topic)]
        [damage] = bag.damage
    assert {*given} <= data_of(recording)  # SQLite would read a page that is missing as zeros
    # All of the log, which repeats each message, and a part of the file.
    assert len(given) >= len(messages) and 'it is truncated' in damage
    assert len(given) + missing_rows(damage) == 2 * len(messages)


@pytest.mark.parametrize('part', [0.001, 0.2, 0.4321, 0.5, 0.777, 0.999, 1.0])
@pytest.mark.parametrize('recording, page, at_once', [
    ('run', PAGE, 1), ('run', PAGE, 50), ('long', 512, 30), ('long', 1024, 10**6)])
def test_log_is_read_as_sqlite_reads_it(tmp_path, recording, page, at_once, part):
    file, messages = file_with_log(tmp_path, recording, page, at_once), RECORDINGS[recording]
    log, copy = Path(f'{file}-wal'), tmp_path / 'copy.db3'
    log.write_bytes(log.read_bytes()[:int(part * log.stat().st_size)])
    shutil.copyfile(file, copy)
    shutil.copyfile(log, f'{copy}-wal')
    with closing(sqlite3.connect(copy)) as database:
        rows = database.execute('SELECT data FROM messages ORDER BY id').fetchall()
    assert [arrival.data for arrival in SqliteScan(file)] == [data for (data,) in rows]
    assert len(rows) >= len(messages) and (part < 1.0 or len(rows) == 2 * len(messages))


def test_page_of_the_log_replaces_that_of_the_file(killed):
    """The last leaf is in both; the file is damaged where SQLite would not look."""
    data = bytearray(killed.read_bytes())
    data[28:32] = struct.pack('>I', 2**20)  # so many pages, and SQLite reads nothing
    killed.write_bytes(data)
    with Bag(killed) as bag:
        assert len(list(bag.messages('/tf'))) == 2 * (len(RUN) - 1)
        assert bag.damage[0].endswith('and nothing is missing')


def test_error_of_a_file_with_a_log_names_the_recording(killed, tmp_path):
    data = bytearray(killed.read_bytes())
    data[PAGE:] = bytes(len(data) - PAGE)
    killed.write_bytes(data)
    with Bag(killed) as bag:
        assert f'(Cannot open database {killed}: ' in bag.damage[0]


@pytest.mark.parametrize('place', [0, 3, 10, 20, 30, 33, 40, 50, 60, 5_000, -5_000, -100])
def test_damaged_log_is_mentioned_and_what_is_before_the_damage_is_read(killed, place):
    log = Path(f'{killed}-wal')
    data = bytearray(log.read_bytes())
    data[place] ^= 255
    log.write_bytes(data)
    with Bag(killed) as bag:
        given = list(bag.messages('/tf'))
        assert bag.damage[0].startswith(f'run.db3 is not whole ({log.name} is damaged): ')
        assert bag.damage[0].endswith(
            f'and it is unknown how many are missing, because {log.name} is damaged')
    assert len(given) == len(RUN) - 1


def test_log_of_another_file_is_mentioned(tmp_path, killed):
    other = tmp_path / 'other'
    other.mkdir()
    shutil.copyfile(f'{file_with_log(other, page=1024)}-wal', f'{killed}-wal')
    with Bag(killed) as bag:
        assert len(list(bag.messages('/tf'))) == len(RUN) - 1
        assert f'({killed.name}-wal is damaged)' in bag.damage[0]


def test_empty_file_with_a_log_is_refused(killed):
    killed.write_bytes(b'')
    with pytest.raises(BagError) as raised:
        Bag(killed)
    assert killed.name in str(raised.value) and 'is damaged' not in str(raised.value)


def test_log_that_is_still_written_is_not_damaged(killed):
    log = Path(f'{killed}-wal')
    data, frame = log.read_bytes(), PAGE + 24
    earlier = bytes(3 * frame)  # SQLite writes a log over an earlier one
    for written in (data[:-1], data[:-frame] + earlier, data[:32 + frame] + earlier, data[:33]):
        log.write_bytes(written)
        with Bag(killed) as bag:
            assert not bag.damage


def test_log_that_cannot_be_used_is_mentioned(killed):
    data = killed.read_bytes()
    killed.write_bytes(data[:19] + b'\7' + data[20:])  # a version of the future
    Path(f'{killed}-wal').write_bytes(b'no log')
    with Bag(killed) as bag:
        assert f'because {killed.name}-wal is damaged' in bag.damage[0]
        assert bag.expected() == len(RUN)


@pytest.fixture(scope='module')
def pieces(tmp_path_factory):
    """Return a file whose log has several transactions, and the bytes of both."""
    file = file_with_log(tmp_path_factory.mktemp('pieces'), page=1024, at_once=40)
    return file, file.read_bytes(), Path(f'{file}-wal').read_bytes()


@examples(2)
@given(part=st.floats(0.3, 1), of_log=st.floats(0, 1), flipped=st.lists(
    st.tuples(st.booleans(), st.floats(0, 1), st.integers(1, 255)), max_size=4))
def test_damage_of_a_file_and_its_log_gives_messages_or_a_reason(pieces, part, of_log, flipped):
    file, *both = pieces
    changed = [bytearray(data[:int(part * len(data))])
               for data, part in zip(both, (part, of_log), strict=True)]
    for in_log, place, bits in flipped:
        data = changed[in_log]
        if data:
            data[int(place * (len(data) - 1))] ^= bits
    file.write_bytes(changed[0])
    Path(f'{file}-wal').write_bytes(changed[1])
    try:
        with Bag(file) as bag:
            found = [arrival.data for connection in bag.everything
                     for arrival in bag.messages(connection.topic)]
    except BagError as error:
        assert file.name in str(error)
        return
    assert len(found) <= 2 * len(RUN)
    if not flipped:
        assert {*found} <= data_of('run')
