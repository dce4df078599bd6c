# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The fields of a message of ROS 2, one after the other, in both byte orders."""

import struct

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.core.messages.byte_cursor import ByteCursor, cdr_cursor, text_of, WireError

HEADS = {'<': b'\0\1\0\0', '>': b'\0\0\0\0'}


def laid_out(order, fields):
    """Write fields byte by byte: (alignment, bytes) each, aligned after the head."""
    body = b''
    for alignment, data in fields:
        while len(body) % alignment:
            body += b'\xee'
        body += data
    return HEADS[order] + body


def string(order, text):
    return struct.pack(order + 'I', len(text)) + text


@for_each(order='<>', length=range(1, 10))
def test_fields_are_aligned_to_the_first_byte_after_the_head(order, length):
    text = b'x' * (length - 1) + b'\0'
    doubles = 1.5, -2.0, 1e300
    cursor = cdr_cursor(laid_out(order, [
        (4, string(order, text)), (8, struct.pack(order + '3d', *doubles)),
        (4, string(order, text)), (4, struct.pack(order + 'iI', -3, 4)),
        (4, string(order, text)), (4, struct.pack(order + 'iI', 5, 999_999_999)),
        (4, string(order, text)), (4, struct.pack(order + 'I', 4_000_000_000))]))
    assert (cursor.order, cursor.position) == (order, 4)
    name = 'x' * (length - 1)
    assert cursor.read_text() == name
    assert cursor.position == 8 + length
    numbers = cursor.read_doubles(3)
    assert (numbers.dtype, numbers.tolist()) == (np.dtype(float), list(doubles))
    begin = cursor.position
    assert cursor.read_string() == (name, slice(begin, begin + 4 + length))
    assert cursor.read_stamp() == -2_999_999_996
    assert cursor.read_text() == name
    assert cursor.read_time() == 5_999_999_999
    assert cursor.read_text() == name
    assert cursor.read_uint32() == 4_000_000_000
    assert cursor.position == len(cursor.data)


def test_each_kind_of_skipped_field_says_where_it_began():
    cursor = ByteCursor(bytes(40), '<')
    assert [cursor.skip(1, 1), cursor.skip(2, 4), cursor.skip(1, 8), cursor.skip_stamp(),
            cursor.skip(0, 8), cursor.skip(0, 1)] == [4, 8, 12, 16, 28, 28]
    assert cursor.position == 28


@pytest.mark.parametrize(('read', 'needed'), [
    (lambda cursor: cursor.read_uint32(), 4), (lambda cursor: cursor.skip_stamp(), 8),
    (lambda cursor: cursor.read_stamp(), 8), (lambda cursor: cursor.read_time(), 8),
    (lambda cursor: cursor.read_doubles(2), 16), (lambda cursor: cursor.skip(5, 1), 5)],
    ids=['uint32', 'skipped stamp', 'stamp', 'time', 'doubles', 'skip'])
def test_field_may_end_with_the_data_and_no_later(read, needed):
    read(cdr_cursor(HEADS['<'] + bytes(needed)))
    with pytest.raises(WireError) as raised:
        read(cdr_cursor(HEADS['<'] + bytes(needed - 1)))
    assert str(raised.value) == f'truncated at byte 4 of {needed + 3}'


def test_string_without_bytes_is_empty():
    for text in (b'', b'\0'):
        cursor = cdr_cursor(laid_out('<', [(4, string('<', text))]))
        assert cursor.read_string() == ('', slice(4, 8 + len(text)))


@pytest.mark.parametrize(('text', 'error'), [
    (b'map', 'the name at byte 8 does not end with NUL'),
    (b'm', 'the name at byte 8 does not end with NUL'),
    (b'm\xff\0', "the name at byte 8 is not UTF-8: b'm\\xff'"),
    (b'\xff' * 60 + b'y\0', f'the name at byte 8 is not UTF-8: {bytes([255] * 60)!r}')])
def test_string_that_is_no_name_is_an_error(text, error):
    cursor = cdr_cursor(laid_out('<', [(4, string('<', text))]))
    with pytest.raises(WireError) as raised:
        cursor.read_text()
    assert str(raised.value) == error


def test_text_is_decoded_as_utf_8():
    assert text_of('gr\u00fcn'.encode(), 7) == 'gr\u00fcn'
    with pytest.raises(WireError) as raised:
        text_of(b'\xfc', 7)
    assert str(raised.value) == "the name at byte 7 is not UTF-8: b'\\xfc'"


@pytest.mark.parametrize(('data', 'shown'), [
    (b'', ''), (b'\0', '00'), (b'\1\0\0\0', '01 00 00 00'), (b'\0\2\0\0\5', '00 02 00 00')])
def test_other_encapsulations_are_an_error(data, shown):
    with pytest.raises(WireError) as raised:
        cdr_cursor(data)
    assert str(raised.value) == f'not CDR: it begins with the bytes {shown}'
