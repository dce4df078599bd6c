# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Messages made from the values of their fields, without constructors and checks.

A constructor and its checked properties take ten times as long as filling the slots. This is the
only file that depends on the slots of messages. If a class has other slots than expected, its
constructor and its properties are used; a test checks that both ways are equal.
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import repeat
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Vector3
from std_msgs.msg import Header

_Function = Callable[..., Any]

_CHECK_FIELDS = getattr(Vector3(), '_check_fields', None)


def maker(cls: type) -> _Function:
    """
    Return a function that makes a message of all its fields, given by position.

    Nothing is checked, converted or copied: a float field needs a float, and an array field the
    type that the message class itself stores.
    """
    return slotted_maker(cls) if slots_are_known(cls) else public_maker(cls)


def whole_maker(cls: type) -> _Function:
    """
    Return a function that makes a message and those in it, of all their values by position.

    Of a ``Pose`` these are x, y, z of its position, then x, y, z, w of its orientation.
    An array or a list is one value.
    """
    known = all(map(slots_are_known, _classes_in(cls)))
    return slotted_whole_maker(cls) if known else public_whole_maker(cls)


def many_maker(cls: type) -> _Function:
    """Return a function that makes messages of columns, a list for each field; see ``maker``."""
    return slotted_many_maker(cls) if slots_are_known(cls) else public_many_maker(cls)


def reader(cls: type) -> _Function:
    """Return a function that reads messages of one kind into columns, a list for each field."""
    return slotted_reader(cls) if slots_are_known(cls) else public_reader(cls)


def slots_are_known(cls: type) -> bool:
    """Return whether a message class is laid out as this file expects."""
    return list(getattr(cls, '__slots__', ())) == [*map('_{}'.format, fields_of(cls)),
                                                   '_check_fields']


def fields_of(cls: Any) -> list[str]:
    """Return the names of a message's fields, in order."""
    return list(cls.get_fields_and_field_types())


@cache
def parts_of(cls: type) -> dict[str, type | None]:
    """Return a message's fields, in order, and the class of those that are messages."""
    example = cls()
    types = {field: type(getattr(example, field)) for field in fields_of(cls)}
    return {field: part if hasattr(part, 'get_fields_and_field_types') else None
            for field, part in types.items()}


def _classes_in(cls: type) -> Iterator[type]:
    """Yield the class of a message, and of every message in it."""
    yield cls
    for part in parts_of(cls).values():
        if part is not None:
            yield from _classes_in(part)


# --- by the public interface


def public_maker(cls: type) -> _Function:
    """Return the maker that calls the constructor."""
    fields = fields_of(cls)
    return lambda *values: cls(**dict(zip(fields, values, strict=True)))


def public_whole_maker(cls: type) -> _Function:
    """Return the maker of whole messages that calls the constructors."""
    leaves = list(_leaves_of(cls))
    return lambda *values: _constructed(cls, dict(zip(leaves, values, strict=True)))


def _constructed(cls: type, values: dict[str, object], place: str = 'message') -> object:
    """Return a message by its constructor; ``values`` are named as ``_leaves_of`` does."""
    return cls(**{
        field: values[f'{place}__{field}'] if part is None
        else _constructed(part, values, f'{place}__{field}')
        for field, part in parts_of(cls).items()})


def public_many_maker(cls: type) -> _Function:
    """Return the maker of many that calls the constructor."""
    make = public_maker(cls)
    return lambda *columns: list(map(make, *columns))


def public_reader(cls: type) -> _Function:
    """Return the reader that reads the properties."""
    fields = fields_of(cls)
    return lambda messages: [[getattr(message, field) for message in messages] for field in fields]


# --- by the slots, with functions generated for the class, as dataclasses does


def slotted_maker(cls: type) -> _Function:
    """Return the maker that fills the slots."""
    return _compiled(cls, f'def function({_list_of("{0}", cls)}):',
                     '    message = new(cls)',
                     f'    {_list_of("message._{0} = {0}", cls, "; ")}',
                     '    message._check_fields = check_fields',
                     '    return message')


def slotted_whole_maker(cls: type) -> _Function:
    """Return the maker of whole messages that fills the slots."""
    classes: dict[str, type] = {}

    def lines_of(cls: type, place: str) -> Iterator[str]:
        classes[f'{place}_cls'] = cls
        yield f'    {place} = new({place}_cls)'
        yield f'    {place}._check_fields = check_fields'
        for field, part in parts_of(cls).items():
            if part is not None:
                yield from lines_of(part, f'{place}__{field}')
            yield f'    {place}._{field} = {place}__{field}'

    body = list(lines_of(cls, 'message'))
    return _compiled(cls, f'def function({", ".join(_leaves_of(cls))}):', *body,
                     '    return message', **classes)


def slotted_many_maker(cls: type) -> _Function:
    """Return the maker of many that fills the slots."""
    columns = _list_of('{0}', cls)
    return _compiled(cls, f'def function({columns}):',
                     f'    messages = list(map(new, repeat(cls, len({fields_of(cls)[0]}))))',
                     f'    for message, {columns} in zip(messages, {columns}):',
                     f'        {_list_of("message._{0} = {0}", cls, "; ")}',
                     '        message._check_fields = check_fields',
                     '    return messages')


def slotted_reader(cls: type) -> _Function:
    """Return the reader that reads the slots."""
    columns = _list_of('[message._{0} for message in messages]', cls)
    return _compiled(cls, 'def function(messages):', f'    return [{columns}]')


def _leaves_of(cls: type, place: str = 'message') -> Iterator[str]:
    """Yield a name for each value in a message: no field's name has two underscores in a row."""
    for field, part in parts_of(cls).items():
        if part is None:
            yield f'{place}__{field}'
        else:
            yield from _leaves_of(part, f'{place}__{field}')


def _list_of(pattern: str, cls: type, between: str = ', ') -> str:
    return between.join(map(pattern.format, fields_of(cls)))


def _compiled(cls: type, *lines: str, **classes: type) -> _Function:
    names: dict[str, Any] = {'new': object.__new__, 'repeat': repeat, 'cls': cls,
                             'check_fields': _CHECK_FIELDS, **classes}
    exec('\n'.join(lines), names)
    return names['function']  # type: ignore[no-any-return]


# --- headers

_time, _header = maker(Time), maker(Header)


def copy_of(header: Header, frame_id: str | None = None) -> Header:
    """Return a copy of a header, with another frame if one is given."""
    return _header(_time(header.stamp.sec, header.stamp.nanosec),
                   header.frame_id if frame_id is None else frame_id)
