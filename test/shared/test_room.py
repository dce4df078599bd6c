# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The free parts of a file."""

from hypothesis import given, strategies as st
from tf_tree_py.shared.memory import Room

SIZE = 1_000


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 200)), max_size=60))
def test_parts_in_use_never_overlap_and_all_is_free_at_the_end(steps):
    room, used = Room(), []
    room.add(0, SIZE)
    for is_taken, number in steps:
        if not is_taken and used:
            room.add(*used.pop(number % len(used)))
        elif (offset := room.take(number)) is not None:
            used.append((offset, number))
        cells = [cell for offset, size in used for cell in range(offset, offset + size)]
        assert len(cells) == len(set(cells))
        assert not cells or 0 <= min(cells) <= max(cells) < SIZE
    for part in used:
        room.add(*part)
    assert room.take(SIZE) == 0  # so neighbours are joined
    assert room.take(1) is None


def test_smallest_part_that_fits_is_taken():
    room = Room()
    for part in ((0, 50), (100, 20), (200, 30)):
        room.add(*part)
    assert [room.take(20), room.take(25), room.take(60)] == [100, 200, None]
