# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A damaged file of SQLite gives every message that is wholly in it, and counts the others."""

from contextlib import closing
import sqlite3
import struct
import tracemalloc

from bags import as_cdr, driving, file_of, missing_rows, RUN, STATIC, write_ros2
import pytest
from tf_tree_py.bag.files.bag_reader import Bag
from tf_tree_py.bag.files.sqlite_scan import SqliteScan

PAGE = 4096
MANY = sorted(driving(count=2_000) + STATIC, key=lambda message: message.received)
DATA = [as_cdr(message.transforms) for message in MANY]


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return the bytes of an undamaged file with many messages."""
    return file_of(write_ros2(tmp_path_factory.mktemp('whole') / 'run', MANY,
                              'sqlite3')).read_bytes()


def scanned(path, data):
    """Return the messages of a file with these bytes, and how many it says are lost."""
    path.write_bytes(data)
    scan = SqliteScan(path)
    return [arrival.data for arrival in scan], scan.lost


@pytest.mark.parametrize('part', [0.06, 0.3, 0.4567, 0.5, 0.7, 0.9, 0.97])
def test_every_message_before_the_cut_is_read_once_and_the_others_are_counted(
        tmp_path, whole, part):
    cut = whole[:int(part * len(whole))]
    given, lost = scanned(tmp_path / 'cut.db3', cut)
    assert given == [data for data in DATA if data in cut]
    assert 'at least' in lost
    # The last leaf of a table has no row id in the page above it.
    assert 0.99 * len(DATA) < len(given) + missing_rows(lost) <= len(DATA)


def pages_of(data, page_type, root):
    """Return the numbers of the pages of one kind that the tree of a table has."""
    found, left = [], [root]
    while left:
        number = left.pop()
        page = data[(number - 1) * PAGE:number * PAGE]
        if page[0] == page_type:
            found.append(number)
        if page[0] == 5:
            count, = struct.unpack_from('>H', page, 3)
            pointers = struct.unpack_from(f'>{count}H', page, 12)
            left += [struct.unpack_from('>I', page, place)[0] for place in (8, *pointers)]
    return sorted(found)


def root_of(path, table):
    with closing(sqlite3.connect(path)) as database:
        [[root]] = database.execute('SELECT rootpage FROM sqlite_schema WHERE name = ?', [table])
    return root


@pytest.fixture
def tree(tmp_path, whole):
    """Return the inner pages and the leaves of the messages."""
    path = tmp_path / 'whole.db3'
    path.write_bytes(whole)
    root = root_of(path, 'messages')
    return pages_of(whole, 5, root), pages_of(whole, 13, root)


def test_without_its_inner_pages_a_file_gives_all_messages(tmp_path, whole, tree):
    data = bytearray(whole)
    for number in tree[0]:
        data[(number - 1) * PAGE:number * PAGE] = bytes(PAGE)
    given, lost = scanned(tmp_path / 'run.db3', data)
    assert given == DATA and lost == 'and it is unknown how many are missing'


def test_leaf_that_is_damaged_costs_its_own_messages_only(tmp_path, whole, tree):
    data = bytearray(whole)
    begin = (tree[1][5] - 1) * PAGE
    own = [each for each in DATA if each in whole[begin:begin + PAGE]]
    data[begin:begin + PAGE] = bytes(PAGE)
    given, lost = scanned(tmp_path / 'run.db3', data)
    assert given == [each for each in DATA if each not in own]
    assert lost == f'and {len(own)} are missing' and len(own) > 5


def test_record_that_is_damaged_costs_itself_only(tmp_path, whole):
    data = bytearray(whole)
    begin = data.index(DATA[100])
    data[begin - 12:begin] = b'\xff' * 12
    given, lost = scanned(tmp_path / 'run.db3', data)
    assert given == DATA[:100] + DATA[101:] and lost == 'and 1 is missing'


@pytest.mark.parametrize('column', ['data', 'timestamp'])
@pytest.mark.parametrize('value', [None, 'text', 1.5])
def test_value_of_another_type_costs_its_message_only(tmp_path, column, value):
    file = file_of(write_ros2(tmp_path / 'run', RUN, 'sqlite3'))
    with closing(sqlite3.connect(file)) as database:
        # A copy of the table forbids nothing.
        database.execute('CREATE TABLE copy AS SELECT * FROM messages ORDER BY id')
        database.execute('DROP TABLE messages')
        database.execute('ALTER TABLE copy RENAME TO messages')
        database.execute(f'UPDATE messages SET {column} = ? WHERE id = 100', [value])
        database.commit()
    with Bag(file) as bag:
        given = [arrival.data for topic in ('/tf', '/tf_static')
                 for arrival in bag.messages(topic)]
        assert len(bag.damage) == 1 and 'is damaged (a message is damaged)' in bag.damage[0]
    there = [as_cdr(message.transforms) for message in RUN]
    assert {*given} == {*there[:99], *there[100:]}


# --- the tables of all versions of rosbag2, in all forms of a file

COLUMNS = {
    'the first': 'id INTEGER PRIMARY KEY,name TEXT,type TEXT,serialization_format TEXT',
    'of Foxy': 'id INTEGER PRIMARY KEY,name TEXT,type TEXT,serialization_format TEXT,'
               'offered_qos_profiles TEXT',
    'of Jazzy': 'id INTEGER PRIMARY KEY,name TEXT,type TEXT,serialization_format TEXT,'
                'offered_qos_profiles TEXT,type_description_hash TEXT',
    'in another order': 'serialization_format TEXT,"type" TEXT,name TEXT,'
                        'size DECIMAL(10, 2) DEFAULT NULL,id INTEGER PRIMARY KEY',
}
SIZES = (0, 30, 300, 5_000, 70_000)
ROWS = [(7, 1_000 + number, bytes([number % 251]) * SIZES[number % 5]) for number in range(200)]


def made(path, columns=COLUMNS['of Jazzy'], *pragmas):
    """Write the rows into a file of SQLite."""
    with closing(sqlite3.connect(path)) as database:
        for pragma in pragmas:
            database.execute(f'PRAGMA {pragma}')
        database.execute(f'CREATE TABLE topics({columns})')
        database.execute('INSERT INTO topics(id, name, type, serialization_format) '
                         "VALUES (7, '/tf', 'tf2_msgs/msg/TFMessage', 'cdr')")
        database.execute('CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,'
                         'timestamp INTEGER NOT NULL, data BLOB NOT NULL)')
        database.executemany(
            'INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)', ROWS)
        database.commit()
    return path


def read(path):
    """Return the rows of a file."""
    scan = SqliteScan(path)
    return [(7, arrival.received, arrival.data) for arrival in scan
            if arrival.connection.topic == '/tf' and arrival.connection.has_transforms], scan.lost


@pytest.mark.parametrize('columns', COLUMNS)
def test_tables_of_each_version_are_read(tmp_path, columns):
    assert read(made(tmp_path / 'run.db3', COLUMNS[columns])) == (ROWS, 'and nothing is missing')


@pytest.mark.parametrize('pragma', [
    'page_size = 512', 'page_size = 65536', "encoding = 'UTF-16le'", "encoding = 'UTF-16be'",
    'auto_vacuum = FULL', 'auto_vacuum = INCREMENTAL'])
@pytest.mark.parametrize('part', [0.5, 1])
def test_files_of_each_form_are_read(tmp_path, pragma, part):
    path = made(tmp_path / 'run.db3', COLUMNS['of Foxy'], pragma)
    path.write_bytes(path.read_bytes()[:int(part * path.stat().st_size)])
    rows, lost = read(path)
    if part == 1:
        assert rows == ROWS and lost == 'and nothing is missing'
    else:
        assert rows == [row for row in ROWS if row in rows] and len(rows) > 0.4 * len(ROWS)
        assert len(rows) + missing_rows(lost) <= len(ROWS)


def test_row_that_was_deleted_stays_deleted(tmp_path):
    path = made(tmp_path / 'run.db3')
    with closing(sqlite3.connect(path)) as database:
        database.execute('DELETE FROM messages WHERE id > 20')
        database.commit()
    assert read(path) == (ROWS[:20], 'and nothing is missing')


def test_row_that_was_deleted_stays_deleted_when_another_page_is_damaged(tmp_path):
    path = made(tmp_path / 'run.db3')
    with closing(sqlite3.connect(path)) as database:
        database.execute('PRAGMA secure_delete = OFF')
        database.execute('DELETE FROM messages WHERE id BETWEEN 50 AND 150')
        database.commit()
    data = bytearray(path.read_bytes())
    assert data.count(ROWS[101][2]) and data.count(ROWS[102][2])
    begin = (pages_of(data, 13, root_of(path, 'messages'))[0] - 1) * PAGE
    data[begin:begin + PAGE] = bytes(PAGE)
    path.write_bytes(data)
    rows, lost = read(path)
    assert 0 < missing_rows(lost) < 20 and rows == ROWS[missing_rows(lost):49] + ROWS[150:]


def test_wherever_a_file_ends_no_message_is_cut(tmp_path):
    path = made(tmp_path / 'run.db3')
    data = path.read_bytes()
    leaves = pages_of(data, 13, root_of(path, 'messages'))
    for end in (*range(5 * PAGE, len(data), 14 * PAGE + 333),
                *((number - 1) * PAGE + 700 for number in leaves)):
        path.write_bytes(data[:end])
        rows, _ = read(path)
        assert rows == [row for row in ROWS if row in rows], end


def test_header_that_reserves_too_much_of_each_page_costs_few_short_messages(tmp_path):
    path = made(tmp_path / 'run.db3')
    data = bytearray(path.read_bytes())
    data[20] = 255
    path.write_bytes(data)
    rows, _ = read(path)
    short = {row for row in ROWS if len(row[2]) < 1000}
    assert {*rows} <= short and len(rows) > 0.95 * len(short)


# --- hostile files: nothing hangs, and nothing takes more than the file has

def cells_with_chains(path):
    """Return the bytes of a file, and the places of its first two cells with a chain of a page."""
    data = bytearray(path.read_bytes())
    begin = (pages_of(data, 13, root_of(path, 'messages'))[0] - 1) * PAGE
    count, = struct.unpack_from('>H', data, begin + 3)
    pointers = struct.unpack_from(f'>{count}H', data, begin + 8)
    size = b'\xa7\x11'  # 5000 bytes and the header of the record
    return data, [begin + pointer for pointer in pointers
                  if data[begin + pointer:begin + pointer + 2] == size]


def chain_of(data, place):
    """Return where the number of the page in a cell's chain is."""
    size = (data[place] & 127) << 7 | data[place + 1]
    least = (PAGE - 12) * 32 // 255 - 23
    return place + 3 + least + (size - least) % (PAGE - 4)


def looped(data, place):
    chain = chain_of(data, place)
    first = data[chain:chain + 4]
    begin = (int.from_bytes(first, 'big') - 1) * PAGE
    data[begin:begin + 4] = first


def pointed_at_nothing(data, place):
    chain = chain_of(data, place)
    data[chain:chain + 4] = b'\xff' * 4


def huge(data, place):
    data[place:place + 9] = b'\x90' + b'\x80' * 7 + b'\0'  # 2**60


def negative(data, place):
    data[place:place + 9] = b'\xff' * 9


def outside(data, place):
    begin = place // PAGE * PAGE
    data[begin + 8:begin + 10] = b'\xff\xff'


@pytest.mark.parametrize('harm', [looped, pointed_at_nothing, huge, negative, outside])
def test_cell_that_lies_costs_itself_and_those_it_lies_on(tmp_path, harm):
    path = made(tmp_path / 'run.db3')
    data, [place, *_] = cells_with_chains(path)
    harm(data, place)
    path.write_bytes(data)
    rows, lost = read(path)
    assert {*rows} < {*ROWS} and len(rows) + missing_rows(lost) == len(ROWS)
    assert missing_rows(lost) <= 2


def test_cells_that_lie_on_each_other_give_no_more_than_their_page_has(tmp_path):
    path = made(tmp_path / 'run.db3')
    root = root_of(path, 'messages')
    data = bytearray(path.read_bytes())
    begin = (pages_of(data, 13, root)[3] - 1) * PAGE
    data[(root - 1) * PAGE] = 0  # so that the leaf may have any row ids
    data[begin + 3:begin + 5] = (200).to_bytes(2, 'big')
    for number in range(200):
        # A record of 408 bytes, whose 400 bytes of data are the next cells.
        cell = b'\x83\x18' + bytes([0x88 + number // 128, number % 128])
        cell += b'\6\0\1\1\x86\x2c\7\1'
        place = 500 + number * len(cell)
        data[begin + 8 + 2 * number:begin + 10 + 2 * number] = place.to_bytes(2, 'big')
        data[begin + place:begin + place + len(cell)] = cell
    path.write_bytes(data)
    rows, _ = read(path)
    forged = [row for row in rows if row not in ROWS]
    assert 400 <= sum(len(data) for *_, data in forged) <= PAGE


def test_chain_that_two_records_share_is_that_of_one(tmp_path):
    path = made(tmp_path / 'run.db3')
    data, places = cells_with_chains(path)
    first, second = (chain_of(data, place) for place in places)
    data[second:second + 4] = data[first:first + 4]
    path.write_bytes(data)
    rows, lost = read(path)
    assert {*rows} < {*ROWS} and lost == 'and 1 is missing'


@pytest.mark.parametrize(('place', 'value'), [
    (16, b'\0\0'), (16, b'\0\3'), (16, b'\2\1'), (20, b'\xff'), (0, b'X')])
def test_header_that_is_impossible_is_refused(tmp_path, place, value):
    path = made(tmp_path / 'run.db3', COLUMNS['of Foxy'], 'page_size = 512')
    data = bytearray(path.read_bytes())
    data[place:place + len(value)] = value
    path.write_bytes(data)
    with pytest.raises(ValueError, match='its pages have an impossible size|begin like SQLite'):
        SqliteScan(path)


def test_inner_page_that_names_itself_is_read_once(tmp_path, whole, tree):
    data = bytearray(whole)
    for number in tree[0]:
        place = (number - 1) * PAGE + 8
        data[place:place + 4] = number.to_bytes(4, 'big')
    given, _ = scanned(tmp_path / 'run.db3', data)
    assert given == DATA


def test_row_ids_in_no_order_are_not_believed(tmp_path, whole, tree):
    """The first key of the root becomes greater than the second one."""
    data = bytearray(whole)
    begin = (tree[0][0] - 1) * PAGE
    pointer, = struct.unpack_from('>H', data, begin + 12)
    assert data[begin + pointer + 4] < 0x81
    data[begin + pointer + 4] = 0x7f
    given, _ = scanned(tmp_path / 'run.db3', data)
    assert given == DATA


def test_row_id_that_no_file_can_reach_is_not_believed(tmp_path):
    path = made(tmp_path / 'run.db3')
    with closing(sqlite3.connect(path)) as database:
        database.execute('UPDATE messages SET id = id + 1000000000000')
        database.commit()
    data = bytearray(path.read_bytes())
    begin = (root_of(path, 'messages') - 1) * PAGE
    data[begin:begin + PAGE] = bytes(PAGE)
    path.write_bytes(data)
    assert read(path) == (ROWS, 'and it is unknown how many are missing')


def test_messages_are_not_held_in_memory(tmp_path):
    path = made(tmp_path / 'run.db3')
    tracemalloc.start()
    try:
        for _ in SqliteScan(path):
            pass
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 0.2 * path.stat().st_size
