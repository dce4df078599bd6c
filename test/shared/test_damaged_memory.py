# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Damaged shared memory: a clear error, or the right answer.

Samples have no checksum, so they are left out here. So is the header's sign of life, which the
writer renews all the time.
"""

from contextlib import suppress
import struct

from hypothesis import example, given, strategies as st
import pytest
from sharing_trees import shared, SharingBuffer
from tf_tree_py import from_seconds
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.layout import (
    BEAT,
    PAGE,
    place_of_record,
    root_of,
    ROOT_WORDS,
    STATE,
    WORD,
)
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import SharedTree

MS = 10 ** 6


@pytest.fixture(scope='module')
def written():
    """Return the domain of a tree of each kind of edge, its contents, and what may be damaged."""
    buffer = SharingBuffer(from_seconds(1.0))
    buffer.insert('map', 'fixed', 0, (1.0, 0, 0, 0, 0, 0.6, 0.8), static=True)
    for number in range(1, 80):
        buffer.insert('map', 'odom', number * MS, (float(number), 0, 0, 0, 0, 0.6, 0.8))
        buffer.insert('odom' if number < 40 else 'fixed', 'base', number * MS,
                      (float(number), 0, 0, 0, 0, 0.6, 0.8), strict=False)
    buffer.insert('map', 'odom', 5 * MS + 1, (0.0, 0, 0, 0, 0, 0, 1))
    with shared(buffer) as (domain_id, _):
        yield domain_id, contents(buffer), Place(domain_id).memory


def contents(tree):
    return tree.frames(), tree.edges(), tree.lookup_tree('map', 60 * MS), tree.lookup_tree(
        'map', 20 * MS), [tree.stamps_of(frame).tolist() for frame in tree.frames()]


def newest_record(data):
    """Return where the header says where the newest record is, in words; and its place."""
    words = memoryview(data)[:PAGE].cast('q')
    pointer = place_of_record(words[STATE] >> 16)
    return pointer, words[pointer], words[pointer + 1]


def look(domain_id):
    """Return what a new reader finds."""
    with SharedTree(domain_id=domain_id) as tree:
        return contents(tree)


def check(written, path, damage):
    """Damage a file, and compare what a new reader and an old one find with what was written."""
    domain_id, expected, path = written
    with SharedTree(domain_id=domain_id) as old, path.open('r+b') as file:
        assert contents(old) == expected
        intact = file.read()
        try:
            for at, part in damage:
                file.seek(at)
                file.write(part)
            file.flush()
            for find in (lambda: look(domain_id), lambda: contents(old)):
                with suppress(SharedTreeException):
                    assert find() == expected
        finally:
            beat = slice(BEAT * WORD, BEAT * WORD + WORD)
            file.seek(0)
            file.write(intact[:beat.start])
            file.seek(beat.stop)
            file.write(intact[beat.stop:])
    assert look(domain_id) == expected


@given(place=st.integers(0), value=st.integers(1, 255), where=st.sampled_from(
    ['header', 'words', 'pointer', 'root', 'rows', 'directory']))
def test_changed_byte(written, place, value, where):
    data = written[2].read_bytes()
    pointer, record, record_bytes = newest_record(data)
    root, root_bytes = root_of(data[record:record + record_bytes]), ROOT_WORDS * WORD
    first, size = {
        'header': (0, PAGE), 'words': (0, 8 * WORD), 'pointer': (pointer * WORD, 2 * WORD),
        'root': (record, root_bytes), 'rows': (record + root_bytes, record_bytes - root_bytes),
        'directory': (root.directory, root.directory_bytes)}[where]
    place = first + place % size
    if BEAT * WORD <= place < BEAT * WORD + WORD:
        return
    check(written, place, [(place, bytes([data[place] ^ value]))])


@given(word=st.integers(0, ROOT_WORDS - 1), value=st.integers(-2 ** 63, 2 ** 63 - 1))
@example(word=1, value=2 ** 62)
@example(word=2, value=2 ** 62)
@example(word=2, value=-1)
@example(word=3, value=-1)
@example(word=4, value=2 ** 62)
def test_nonsense_in_the_newest_root(written, word, value):
    _, record, _ = newest_record(written[2].read_bytes())
    check(written, record, [(record + word * WORD, struct.pack('q', value))])


@given(word=st.integers(0, 1), value=st.integers(-2 ** 63, 2 ** 63 - 1))
@example(word=0, value=-1)
@example(word=0, value=2 ** 62)
@example(word=1, value=-1)
@example(word=1, value=0)
@example(word=1, value=8)
@example(word=1, value=2 ** 62)
def test_nonsense_where_the_newest_record_is(written, word, value):
    pointer, _, _ = newest_record(written[2].read_bytes())
    check(written, pointer, [((pointer + word) * WORD, struct.pack('q', value))])


@given(word=st.sampled_from([0, 1, 2, 4, 5, 6, 7]), value=st.integers(-2 ** 63, 2 ** 63 - 1))
@example(word=4, value=0)
@example(word=4, value=-1)
@example(word=5, value=2 ** 62)
@example(word=6, value=2 ** 62)
@example(word=6, value=-1)
def test_nonsense_in_the_header(written, word, value):
    check(written, word, [(word * WORD, struct.pack('q', value))])


@pytest.mark.parametrize('size', [0, 100, PAGE - 1, PAGE])
def test_file_that_is_too_short(size, tmp_path):
    """It appears so at once; a file that is cut while it is mapped kills all who read it."""
    buffer = SharingBuffer()
    with shared(buffer) as (domain_id, _):
        path = Place(domain_id).memory
        short = path.with_name('short')
        short.write_bytes(path.read_bytes()[:size])
        short.rename(path)
        with pytest.raises(SharedTreeException, match='cannot be read|No process|has died'):
            SharedTree(domain_id=domain_id)
