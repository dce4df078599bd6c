# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A saved and loaded buffer returns the same results; incomplete files are reported.

test_edges checks that each kind of history is unchanged.
"""

from contextlib import suppress
import copy
import json
import os
import pickle
import struct
import zlib

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import waving_poses
from tf_tree_py import BufferCore, load, screws, Spline
from tf_tree_py.buffer_core import Snapshot
from tf_tree_py.core import Pose, Poses, TransformException, TreeFileError, UNLIMITED
from tf_tree_py.files.tree_file import load_tree, saved_tree

SECOND = 10**9


def poses(seed=3):
    """Return a function that returns random poses, one after the other."""
    rng = np.random.default_rng(seed)
    return lambda: screws.exp(tuple(rng.normal(size=6).tolist()))


def fill(buffer):
    """Insert edges that move, are static, change their parent, and are reversed."""
    pose = poses()
    for number in range(200):
        stamp = SECOND + number * SECOND // 20
        buffer.insert('map', 'odom', stamp, pose(), authority='slam')
        buffer.insert('odom', 'base', stamp + 7, pose())
        buffer.insert('table' if number < 90 else 'base', 'cup', stamp, pose(), strict=False)
    buffer.insert('base', 'lidar', 0, pose(), static=True)
    buffer.insert('a', 'b', SECOND, pose())
    buffer.insert('a', 'b', 2 * SECOND, pose())
    buffer.insert('b', 'a', 9 * SECOND, pose(), strict=False)
    buffer.insert('map', 'näme', 5, pose())
    fill_with_more_than_samples(buffer)
    return buffer


def fill_with_more_than_samples(buffer):
    """Insert a spline that covers the end, a partly unused gyroscope, covariances."""
    pose, rng = poses(4), np.random.default_rng(5)
    stamps = np.arange(8 * SECOND, 11 * SECOND, SECOND // 20)
    buffer.insert_curve('base', 'imu', Spline.fit(stamps, waving_poses(stamps * 1e-9), 10.0))
    buffer.insert_curve('imu', 'screw', Spline.fit(
        stamps, waving_poses(stamps * 1e-9), 10.0, on_se3=True))
    rates = rng.normal(size=(len(stamps), 3))
    buffer.aid('odom', stamps + 3, rates)
    buffer.aid('nobody', stamps, rates)
    for stamp in stamps.tolist():
        buffer.insert('imu', 'gps', stamp, pose(), covariance=np.diag(rng.random(6)) * 1e-4)
    buffer.insert('gps', 'roof', 0, pose(), static=True, covariance=np.eye(6) * 1e-8)


class Summed:
    """Numbers from numpy sums: their last bits depend on their alignment in memory."""

    def __init__(self, numbers):
        self.numbers = numbers

    def __eq__(self, other):
        return np.allclose(self.numbers, other.numbers, rtol=1e-12, atol=1e-14)


def answers(buffer):
    """Return the results of all lookups of all pairs, at samples, between and beyond them."""
    found = []
    for stamp in [0, 5, SECOND, SECOND + 7, 3 * SECOND // 2, 5 * SECOND + 3, 8 * SECOND,
                  99 * SECOND]:
        for target in buffer.frames():
            found.append(buffer.lookup_tree(target, stamp))
            for source in buffer.frames():
                try:
                    found.append(buffer.lookup_at(target, source, stamp))
                except TransformException as error:
                    found.append(str(error))
    for source in 'roof', 'odom', 'screw':
        latest = buffer.latest_common_time('map', source)
        found += [Summed(part) if isinstance(part, np.ndarray | Poses) else part for part in (
            *buffer.lookup_uncertain('map', source),
            *buffer.lookup_uncertain_many('map', source, [latest - 7, latest]),
            *buffer.predict('map', source, latest + SECOND // 10, SECOND))]
    stamps = np.arange(SECOND, 12 * SECOND, SECOND // 7)
    for source in ('cup', 'lidar', 'roof', 'screw'):
        found.append([part.tobytes() for part in
                      buffer.lookup_many('map', source, stamps, outside='mask')])
    return [*found, buffer.edges(), buffer.frames(), buffer.cache_time]


@pytest.fixture(params=[UNLIMITED, 3 * SECOND], ids=['everything', 'a window'])
def buffer(request):
    return fill(BufferCore(request.param))


@pytest.mark.parametrize('again', [
    lambda saved: saved,
    lambda saved: pickle.loads(pickle.dumps(saved)),
    copy.copy,
    copy.deepcopy,
    lambda saved: saved.snapshot(),
], ids=['loaded', 'pickled', 'copied', 'copied deeply', 'its snapshot'])
def test_loaded_buffer_answers_exactly_as_the_saved_one(tmp_path, buffer, again):
    buffer.save(tmp_path / 'run.tftree')
    assert answers(again(load(tmp_path / 'run.tftree'))) == answers(buffer)


def test_loaded_buffer_can_be_saved_again(tmp_path, buffer):
    buffer.save(tmp_path / 'one.tftree')
    load(tmp_path / 'one.tftree').save(tmp_path / 'two.tftree')
    assert (tmp_path / 'one.tftree').read_bytes() == (tmp_path / 'two.tftree').read_bytes()


def test_buffer_that_lives_can_be_saved_and_goes_on(tmp_path, buffer):
    buffer.save(tmp_path / 'run.tftree')
    buffer.insert('odom', 'base', 20 * SECOND, Pose())
    assert buffer.latest_common_time('odom', 'base') == 20 * SECOND
    assert load(tmp_path / 'run.tftree').latest_common_time('odom', 'base') < 20 * SECOND


def test_empty_buffer_is_saved_too(tmp_path):
    BufferCore().save(tmp_path / 'empty.tftree')
    assert load(tmp_path / 'empty.tftree').frames() == []


# --- invalid files

def test_file_that_ends_early_anywhere_is_told(tmp_path, buffer):
    path = tmp_path / 'run.tftree'
    buffer.save(path)
    whole = path.read_bytes()
    for size in (*range(40), 400, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(TreeFileError, match='run.tftree.*(not a saved tree|damaged)'):
            load(path)
    path.write_bytes(whole + b'more')
    with pytest.raises(TreeFileError, match='damaged'):
        load(path)


def test_header_that_was_changed_is_told(tmp_path, buffer):
    path = tmp_path / 'run.tftree'
    buffer.save(path)
    path.write_bytes(path.read_bytes().replace(b'"base"', b'"bass"', 1))
    with pytest.raises(TreeFileError, match='damaged: the header'):
        load(path)


def test_every_bit_that_flips_is_found_where_the_file_is_verified(tmp_path):
    buffer, path, pose = BufferCore(), tmp_path / 'run.tftree', poses()
    for stamp in range(1, 6):
        buffer.insert('map', 'base', stamp * SECOND, pose())
    buffer.insert('base', 'lidar', 0, pose(), static=True)
    buffer.save(path)
    data = bytearray(path.read_bytes())
    assert load_tree(bytes(data), verify=True).histories
    for place in range(8 * len(data)):
        data[place // 8] ^= 1 << place % 8
        with pytest.raises(TreeFileError):
            load_tree(data, verify=True)
        data[place // 8] ^= 1 << place % 8


def test_sample_that_changed_is_a_wrong_number_unless_the_file_is_verified(tmp_path, buffer):
    path = tmp_path / 'run.tftree'
    buffer.save(path)
    assert load(path, verify=True).frames() == buffer.frames()
    data = bytearray(path.read_bytes())
    data[-3] ^= 4
    path.write_bytes(data)
    load(path)
    with pytest.raises(TreeFileError, match='run.tftree is damaged: its samples have changed'):
        load(path, verify=True)


def test_file_without_a_checksum_cannot_be_verified(tmp_path, buffer):
    path = tmp_path / 'run.tftree'
    path.write_bytes(saved_tree(buffer.intake.tree).as_bytes())
    load(path)
    with pytest.raises(TreeFileError, match='no checksum.*without verify=True, and save it'):
        load(path, verify=True)


@pytest.mark.parametrize('version', [2, 4])
def test_file_of_another_layout_is_refused_by_its_version(tmp_path, buffer, version):
    """Such as one of version 2, whose edges have no interpolation of their own."""
    path = tmp_path / 'old.tftree'
    buffer.save(path)
    magic, _, *others = struct.unpack_from('<8sIII', path.read_bytes())
    path.write_bytes(struct.pack('<8sIII', magic, version, *others) + path.read_bytes()[20:])
    with pytest.raises(TreeFileError, match=f'old.tftree is a saved tree of version {version}, '
                       'and this tf_tree_py reads version 3: use the version that wrote it'):
        load(path)


def test_foreign_missing_and_unwritable_files_are_told(tmp_path):
    foreign = tmp_path / 'run.mcap'
    foreign.write_bytes(b'\x89MCAP0\r\n' * 10)
    with pytest.raises(TreeFileError, match='run.mcap is not a saved tree'):
        load(foreign)
    with pytest.raises(TreeFileError, match='cannot be read: No such file'):
        load(tmp_path / 'missing.tftree')
    with pytest.raises(TreeFileError, match='cannot be read: Is a directory'):
        load(tmp_path)
    with pytest.raises(TreeFileError, match='cannot be written: No such file'):
        BufferCore().save(tmp_path / 'nowhere' / 'run.tftree')
    assert [path.name for path in tmp_path.iterdir()] == ['run.mcap']


def test_pipe_without_a_writer_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(TreeFileError, match='is empty, not a saved tree'):
        load(tmp_path / 'pipe')


# --- malicious files

PREFIX = struct.Struct('<8sIII')
WHOLE = saved_tree(fill(BufferCore(3 * SECOND)).intake.tree).as_bytes()
MAGIC, VERSION, SIZE, _ = PREFIX.unpack_from(WHOLE)
HEADER_ENDS = PREFIX.size + SIZE
FACTS = json.loads(WHOLE[PREFIX.size:HEADER_ENDS])


def places_in(facts):
    """Yield every list and dictionary in the header, with each of its keys."""
    for key in range(len(facts)) if isinstance(facts, list) else list(facts):
        yield facts, key
        if isinstance(facts[key], list | dict):
            yield from places_in(facts[key])


def nothing_but_the_tree_error(data):
    """Open a file, if possible; lookups in it fail as in any other tree, and end."""
    try:
        tree = load_tree(data)
    except TreeFileError as error:
        assert len(str(error)) < 5000
        return
    loaded = Snapshot(tree)
    for target in loaded.frames()[:10:3]:
        for ask in (lambda target=target: loaded.lookup_tree(target, 9 * SECOND),
                    *(lambda source=source, target=target: ask_for(loaded, target, source)
                      for source in loaded.frames()[:12:2])):
            with suppress(TransformException):
                ask()
    assert repr(loaded) and loaded.snapshot().edges() == loaded.edges()


def ask_for(loaded, target, source):
    loaded.lookup_many(target, source, [SECOND, 9 * SECOND], outside='mask')
    loaded.predict(target, source, 12 * SECOND, SECOND)
    loaded.lookup_uncertain(target, source, 9 * SECOND + 1)


@examples(5.0)
@given(st.data())
def test_facts_that_cannot_be_are_told_whoever_wrote_them(data):
    facts = json.loads(json.dumps(FACTS))
    for _ in range(data.draw(st.integers(1, 3))):
        holder, key = data.draw(st.sampled_from(list(places_in(facts))))
        holder[key] = data.draw(st.sampled_from([
            None, 0, 1, -1, 7, 2**70, -2**70, 1.5, True, 'map', 'base', '', 'held', 'aided',
            'spline', 'interpolated', 'static', 'x' * 10**5, [], {}, [1], ['map'], SECOND]))
    header = json.dumps(facts).encode()
    header += b' ' * (-(PREFIX.size + len(header)) % 8)
    nothing_but_the_tree_error(
        PREFIX.pack(MAGIC, VERSION, len(header), zlib.crc32(header)) + header
        + WHOLE[HEADER_ENDS:])


@pytest.mark.filterwarnings('ignore::RuntimeWarning')  # of numpy, about infinities
@examples(2.0)
@given(st.lists(st.tuples(st.integers(0, len(WHOLE) - 1), st.binary(min_size=1, max_size=99)),
                min_size=1, max_size=30), st.booleans())
def test_bytes_that_were_changed_are_wrong_numbers_at_worst(changes, in_arrays):
    data = bytearray(WHOLE)
    for place, changed in changes:
        place = max(place, HEADER_ENDS) if in_arrays else place
        data[place:place + len(changed)] = changed[:len(data) - place]
    nothing_but_the_tree_error(bytes(data))
