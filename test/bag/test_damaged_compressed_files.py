# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A compressed file that is truncated or damaged gives all that can be unpacked of it."""

from pathlib import Path
import re
import tempfile

from bags import driving, file_of, STATIC, write_ros1, write_ros2
import pytest
from tf_tree_py.bag import BagError
from tf_tree_py.bag.files import connections
from tf_tree_py.bag.files.bag_reader import Bag
from tf_tree_py.bag.files.discovery import PACKED
from tf_tree_py.bag.files.unpacking import zstd

MANY = sorted(driving(count=3_000) + STATIC, key=lambda message: message.received)
WRITE = {
    'mcap': lambda path: file_of(write_ros2(path, MANY)),
    'db3': lambda path: file_of(write_ros2(path, MANY, 'sqlite3')),
    'bag': lambda path: write_ros1(path.with_suffix('.bag'), MANY),
}


@pytest.fixture(scope='module', params=WRITE)
def plain(request, tmp_path_factory):
    """Return a file that is not compressed."""
    return WRITE[request.param](tmp_path_factory.mktemp('plain') / 'run')


@pytest.fixture(autouse=True)
def copies(tmp_path, monkeypatch):
    """Return the folder for temporary copies; at the end of a test it has to be empty."""
    folder = tmp_path / 'copies'
    folder.mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(folder))
    yield folder
    assert not [*folder.iterdir()]


def read(path):
    """Return all messages of a bag, and what it says about its damage."""
    with Bag(path) as bag:
        messages = [arrival.data for arrival in bag.arrivals()]
        return messages, bag.damage


def packed(tmp_path, plain, suffix='.zstd'):
    path = tmp_path / f'{plain.name}{suffix}'
    path.write_bytes(zstd.compress(plain.read_bytes()))
    return path


@pytest.mark.parametrize('suffix', PACKED)
def test_compressed_file_of_either_suffix_is_read(tmp_path, plain, suffix):
    path = packed(tmp_path, plain, suffix)
    assert read(path) == (read(plain)[0], [])
    folder = tmp_path / 'folder'
    folder.mkdir()
    assert read(path.rename(folder / path.name).parent) == (read(plain)[0], [])


@pytest.mark.parametrize('part', [0.3, 0.5, 0.7, 0.9])
def test_file_that_ends_too_soon_gives_all_that_it_unpacks_to(tmp_path, plain, part):
    path = packed(tmp_path, plain)
    data = path.read_bytes()
    path.write_bytes(data[:int(part * len(data))])
    begin = zstd.ZstdDecompressor().decompress(path.read_bytes())
    cut = tmp_path / plain.name
    cut.write_bytes(begin)
    given, [damage] = read(path)
    assert given == read(cut)[0] and len(given) > 0.7 * part * len(MANY)
    assert damage.startswith(f'{path.name} is not whole (the compressed file ends too soon: ')
    used, size, unpacked = map(_number, re.search(
        '([0-9,]+) of its ([0-9,]+) bytes unpack to ([0-9,]+)', damage).groups())
    assert size == path.stat().st_size and unpacked == len(begin)
    assert 0.7 * size < used <= size and f'{len(given)} messages could be read' in damage


def _number(text):
    return int(text.replace(',', ''))


def blocks_of(data):
    """Return where the blocks of a frame of zstd begin."""
    single, size = data[4] >> 5 & 1, data[4] >> 6
    place = 5 + (not single) + (2**size if size else single)
    places, last = [], False
    while not last:
        places.append(place)
        header = int.from_bytes(data[place:place + 3], 'little')
        last = header & 1
        place += 3 + (1 if header >> 1 & 3 == 1 else header >> 3)
    return places


@pytest.mark.parametrize('number', [2, 5])
def test_file_that_is_damaged_in_the_middle_gives_all_before_that(tmp_path, plain, number):
    path = packed(tmp_path, plain)
    data = bytearray(path.read_bytes())
    place = blocks_of(data)[number]
    begin = zstd.ZstdDecompressor().decompress(data[:place])
    assert len(begin) > number * 2**15
    data[place] |= 6  # a kind of block that does not exist
    path.write_bytes(data)
    cut = tmp_path / plain.name
    cut.write_bytes(begin)
    given, [damage] = read(path)
    assert given == read(cut)[0] and given
    assert 'the compressed file is damaged, so its last messages may be wrong (' in damage


def test_file_of_several_frames_and_a_rest_is_read_to_its_end(tmp_path, plain):
    data = plain.read_bytes()
    path = tmp_path / f'{plain.name}.zst'
    path.write_bytes(b''.join(zstd.compress(data[begin:begin + 100_000])
                              for begin in range(0, len(data), 100_000)))
    assert read(path) == (read(plain)[0], [])
    path.write_bytes(path.read_bytes() + b'something else')
    given, [damage] = read(path)
    assert given == read(plain)[0] and 'the compressed file is damaged' in damage


def test_end_between_two_chunks_is_not_taken_for_a_missing_index(tmp_path):
    data = WRITE['bag'](tmp_path / 'run').read_bytes()
    index = int.from_bytes(data.partition(b'index_pos=')[2][:8], 'little')
    packer = zstd.ZstdCompressor()
    path = tmp_path / 'run.bag.zstd'
    path.write_bytes(packer.compress(data[:index], packer.FLUSH_BLOCK))
    given, [damage] = read(path)
    assert len(given) == len(MANY)
    assert 'is not whole' in damage and 'it is unknown how many are missing' in damage


@pytest.mark.parametrize('size', [0, 3, 20])
def test_file_that_unpacks_to_nothing_is_refused_by_its_name(tmp_path, plain, size):
    path = packed(tmp_path, plain)
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(BagError) as raised:
        Bag(path)
    assert path.name in str(raised.value) and 'copies' not in str(raised.value)
    assert not size or 'the compressed file ends too soon' in str(raised.value)


def test_begin_of_a_bomb_is_refused_like_the_whole(tmp_path, monkeypatch, plain):
    monkeypatch.setattr(connections, 'ALWAYS', 2**20)
    path = tmp_path / f'{plain.name}.zst'
    path.write_bytes(zstd.compress(plain.read_bytes() + bytes(2**24))[:-100])
    monkeypatch.setattr(connections, 'TIMES', 2)
    with pytest.raises(BagError, match='the file of .* unpacks to more than'):
        Bag(Path(path))
