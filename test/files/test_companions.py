# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Data beside the samples is copied, saved and cleared with them, whatever its kind."""

import struct
import zlib

import pytest
from tf_tree_py import BufferCore, load
from tf_tree_py.core import Pose, TreeFileError
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.files.tree_file import load_file

SECOND = 10**9


class Notes(Companion):
    """A note on each edge, by child frame."""

    key = 'notes'

    def __init__(self):
        self.by_child = {}
        self.changes = 0

    def copy(self):
        twin = Notes()
        twin.by_child = dict(self.by_child)
        return twin

    def clear(self, histories):
        self.by_child = {child: note for child, note in self.by_child.items()
                         if not moves(histories.get(child))}

    def remove(self, frame):
        self.by_child.pop(frame, None)

    def structure_changed(self):
        self.changes += 1

    def save(self, arrays):
        return self.by_child

    @classmethod
    def load(cls, saved):
        twin = cls()
        part = saved.part(cls.key)
        twin.by_child = {name: part.one(name, str) for name in part.names()}
        return twin


class Cache(Companion):
    """A companion that uses none of the tree's events."""


@pytest.fixture
def buffer():
    made = BufferCore()
    made.insert('map', 'odom', SECOND, Pose(x=1.0))
    made.insert('odom', 'base', SECOND, Pose(x=1.0))
    made.insert('base', 'lidar', 0, Pose(z=1.0), static=True)
    notes_of(made.intake.tree).by_child.update(odom='slips', lidar='new')
    return made


def notes_of(tree):
    return tree.companion_or_new(Notes)


def test_copy_of_a_tree_has_copies(buffer):
    still = buffer.intake.tree.copy()
    notes_of(buffer.intake.tree).by_child['odom'] = 'fixed'
    assert notes_of(still).by_child == {'odom': 'slips', 'lidar': 'new'}


def test_what_does_not_copy_itself_is_not_in_a_copy(buffer):
    cache = buffer.intake.tree.companion_or_new(Cache)
    assert buffer.intake.tree.companion(Cache) is cache
    assert Cache not in buffer.intake.tree.copy().companions


def test_clearing_keeps_what_belongs_to_static_edges(buffer):
    buffer.clear()
    assert notes_of(buffer.intake.tree).by_child == {'lidar': 'new'}


def test_removing_a_frame_removes_what_belongs_to_it(buffer):
    buffer.remove_frame('lidar')
    assert notes_of(buffer.intake.tree).by_child == {'odom': 'slips'}


def test_companion_is_notified_when_an_edge_is_new_and_not_of_each_sample(buffer):
    before = notes_of(buffer.intake.tree).changes
    buffer.insert('map', 'odom', 2 * SECOND, Pose(x=2.0))
    assert notes_of(buffer.intake.tree).changes == before
    buffer.insert('map', 'table', 2 * SECOND, Pose(x=2.0))
    assert notes_of(buffer.intake.tree).changes > before


def test_file_contains_it(buffer, tmp_path):
    buffer.save(tmp_path / 'run.tftree')
    notes = notes_of(load_file(tmp_path / 'run.tftree'))
    assert notes.by_child == {'odom': 'slips', 'lidar': 'new'}


def test_file_does_not_contain_an_empty_one(buffer, tmp_path):
    notes_of(buffer.intake.tree).by_child.clear()
    buffer.intake.tree.companion_or_new(Cache)
    buffer.save(tmp_path / 'run.tftree')
    assert load_file(tmp_path / 'run.tftree').companions == {}


def test_file_cannot_ask_for_what_is_never_saved(buffer, tmp_path):
    path = tmp_path / 'run.tftree'
    buffer.save(path)
    prefix, data = struct.Struct('<8sIII'), path.read_bytes()
    magic, version, length, _ = prefix.unpack_from(data)
    header = data[prefix.size:prefix.size + length].rstrip().replace(b'{', b'{"": {}, ', 1)
    header += b' ' * (-(prefix.size + len(header)) % 8)
    path.write_bytes(prefix.pack(magic, version, len(header), zlib.crc32(header)) + header
                     + data[prefix.size + length:])
    with pytest.raises(TreeFileError, match="it contains '', which is not installed here"):
        load(path)


def test_file_with_a_kind_that_is_not_installed_is_refused_by_name(
        buffer, tmp_path, monkeypatch):
    buffer.save(tmp_path / 'run.tftree')
    monkeypatch.setattr(Notes, 'key', '')
    with pytest.raises(TreeFileError, match="it contains 'notes', which is not installed here"):
        load(tmp_path / 'run.tftree')
