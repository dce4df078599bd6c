# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Create, inspect and change messages of any type, for tests of all types."""

from array import array
from copy import deepcopy
from importlib import import_module
import math
import re

from hypothesis import strategies as st
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from strategies import about, axes
from tf_tree_py.ros.messages.convert import transform_stamped

INTEGERS = {'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64', 'octet'}
FLOATS = {'float', 'double'}
DATATYPES = {'f4': PointField.FLOAT32, 'f8': PointField.FLOAT64, 'u1': PointField.UINT8,
             'u2': PointField.UINT16, 'i4': PointField.INT32, 'u4': PointField.UINT32}


def stamped_transform(pose, frame_id='map', child_frame_id='base', stamp=5_000_000_007):
    """Return a ``TransformStamped`` of seven numbers."""
    return transform_stamped(frame_id, child_frame_id, stamp, pose)


# --- creating


def _plain(rng):
    return float(rng.normal())


def filled(cls, rng, number=_plain, length=3):
    """
    Return a message with a value in every field.

    :param number: creates the numbers of float fields; by default plain floats.
    """
    message = cls()
    for field, name in cls.get_fields_and_field_types().items():
        setattr(message, '_' + field, _value(name, rng, number, length))
    return message


def _value(name, rng, number, length):
    sequence = re.fullmatch(r'sequence<([^,>]+)(?:, \d+)?>', name)
    fixed = re.fullmatch(r'(.+)\[(\d+)\]', name)
    if sequence and sequence[1] in FLOATS:
        return array('f' if sequence[1] == 'float' else 'd', rng.uniform(0.5, 2.0, length))
    if sequence and sequence[1] == 'uint8':
        return array('B', rng.integers(0, 256, length).tolist())
    if sequence:
        return [_value(sequence[1], rng, number, length) for _ in range(length)]
    if fixed:
        return np.array([float(number(rng)) for _ in range(int(fixed[2]))])
    if name in FLOATS:
        return number(rng)
    if name in INTEGERS:
        return int(rng.integers(0, 100))
    if name == 'boolean':
        return bool(rng.integers(0, 2))
    if name == 'string':
        return 'base'
    package, message = name.split('/')
    return filled(getattr(import_module(f'{package}.msg'), message), rng, number, length)


def make_cloud(columns, offsets, point_step, height=1, row_padding=0, big=False, tail=0, seed=0):
    """
    Return a cloud whose gaps are filled with noise.

    :param columns: {name: (N,) array}, whose types are those of the fields.
    """
    count = len(next(iter(columns.values())))
    width = count // height
    row_step = width * point_step + row_padding
    noise = np.random.default_rng(seed).integers(0, 256, height * row_step + tail)
    data = array('B', noise.astype(np.uint8).tobytes())
    fields = []
    for name, values in columns.items():
        dtype = np.dtype(values.dtype).newbyteorder('>' if big else '<')
        view = np.ndarray((height, width), dtype, data, offsets[name], (row_step, point_step))
        view[:] = values.reshape(height, width)
        fields.append(PointField(name=name, offset=offsets[name], count=1,
                                 datatype=DATATYPES[values.dtype.str[1:]]))
    return PointCloud2(header=Header(frame_id='lidar'), height=height, width=width, fields=fields,
                       is_bigendian=big, point_step=point_step, row_step=row_step, data=data,
                       is_dense=False)


# --- inspecting


def fields(message):
    return [(field, getattr(message, field)) for field in message.get_fields_and_field_types()]


def is_message(value):
    return hasattr(value, 'get_fields_and_field_types')


def leaves(value, path=''):
    """Yield (path, number or text) of everything in a message."""
    if is_message(value):
        for field, inner in fields(value):
            yield from leaves(inner, f'{path}.{field}')
    elif isinstance(value, list | array | np.ndarray):
        for number, inner in enumerate(value):
            yield from leaves(inner, f'{path}[{number}]')
    else:
        yield path, value


def mutable_parts(value):
    """Yield everything inside a message that could be changed in place, and its memory."""
    if is_message(value):
        yield value
        for _, inner in fields(value):
            yield from mutable_parts(inner)
    elif isinstance(value, list | array | np.ndarray):
        yield value
        for inner in value if isinstance(value, list) else [getattr(value, 'base', None)]:
            yield from mutable_parts(inner)


def numbers(message):
    """Return all floats in a message, in order."""
    return np.array([value for _, value in leaves(message) if isinstance(value, float)])


def assert_shares_nothing(function, *messages):
    """Assert that a result and the messages it is made of can be changed independently."""
    before = deepcopy(messages)
    result = function(*messages)
    assert messages == before
    parts = {id(part) for message in messages for part in mutable_parts(message)}
    assert not parts & {id(part) for part in mutable_parts(result)}


# --- random messages


_numbers = st.floats(-100.0, 100.0, allow_subnormal=False)
poses = st.builds(lambda translation, rotation: (*translation, *rotation),
                  st.tuples(_numbers, _numbers, _numbers),
                  # The second half of the turn is that of the negative quaternions.
                  st.builds(about, axes, st.floats(0.0, 2.0 * math.pi)))
seeds = st.integers(0, 2**32 - 1)
transforms = poses.map(stamped_transform)
