# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The scalar form of each formula and its form for arrays return the same."""

import itertools
import math

from inputs import for_each
import numpy as np
from strategies import MILLION
from tf_tree_py import screws
from tf_tree_py.core.geometry import se3, so3

ARGUMENTS = {
    (so3, 'multiply'): 'qq',
    (so3, 'conjugate'): 'q',
    (so3, 'rotate'): 'qv',
    (so3, 'with_tf2_sign'): 'q',
    (so3, 'slerp_weights'): 'cr',
    (so3, 'slerp'): 'qqr',
    (so3, 'exp'): 'w',
    (so3, 'log'): 'q',
    (so3, 'as_matrix'): 'q',
    (so3, 'from_matrix'): 'R',
    (se3, 'compose'): 'pp',
    (se3, 'inverse'): 'p',
    (se3, 'distance'): 'pp',
    (se3, 'apply'): 'pv',
    (se3, 'interpolate'): 'ppr',
    (se3, 'as_matrix'): 'p',
    (se3, 'from_matrix'): 'T',
    (screws, 'exp'): 't',
    (screws, 'log'): 'p',
    (screws, 'carry'): 'pt',
}


def special_rotation_vectors(rng, count):
    """Return rotation vectors of every size: zero, tiny, at the end of a series, half a turn."""
    sizes = [0.0, 1e-12, 1e-7, 1e-3, np.nextafter(1e-3, 1), 0.1, 1.0, math.pi - 1e-9, math.pi]
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return directions * np.resize(sizes, count)[:, None]


def arguments(what, rng, count):
    """Return (count, ...) arguments, and each of them for the scalar form."""
    w = special_rotation_vectors(rng, count)
    q = so3.exp_many(w) * rng.choice([1.0, -1.0], size=(count, 1))
    v = rng.normal(size=(count, 3)) * np.resize([1.0, MILLION, 1e-9], count)[:, None]
    pose = np.concatenate([v, q], axis=-1)
    array = {
        'q': q,
        'v': v,
        'w': w,
        'p': pose,
        't': np.concatenate([v, w], axis=-1),
        'r': np.resize([0.0, 1.0, 0.5, 0.123], count),
        'c': np.resize([1.0, -1.0, 0.0, 0.7, -0.7, 1.0 - 1e-16, 1e-6 - 1.0, 1.0 + 3e-16], count),
        'R': so3.as_matrix_many(q),
        'T': se3.as_matrix_many(pose),
    }[what]
    if array.ndim == 1:
        return array, array.tolist()
    return array, [tuple(row) if array.ndim == 2 else row for row in array.tolist()]


def pairs_of_forms():
    return [
        (module, name) for module in (so3, se3, screws) for name in vars(module)
        if not name.startswith('_') and f'{name}_many' in vars(module)
    ]


def test_every_pair_of_forms_is_compared():
    assert set(pairs_of_forms()) == set(ARGUMENTS)


@for_each(form=pairs_of_forms())
def test_scalar_and_vectorised_form_agree(form):
    module, name = form
    rng = np.random.default_rng(3)
    arrays, scalars = zip(*(arguments(what, rng, 72) for what in ARGUMENTS[module, name]),
                          strict=True)
    expected = [getattr(module, name)(*values) for values in zip(*scalars, strict=True)]
    assert_equal_forms(getattr(module, f'{name}_many')(*arrays), expected)


@for_each(form=pairs_of_forms())
def test_vectorised_form_broadcasts(form):
    module, name = form
    rng = np.random.default_rng(4)
    wanted = ARGUMENTS[module, name]
    arrays, scalars = zip(*(arguments(what, rng, 3 + i) for i, what in enumerate(wanted)),
                          strict=True)
    spread = [np.reshape(array, (*(len(array) if i == k else 1 for k in range(len(wanted))),
                                 *array.shape[1:])) for i, array in enumerate(arrays)]
    results = getattr(module, f'{name}_many')(*spread)
    expected = [getattr(module, name)(*values) for values in itertools.product(*scalars)]
    assert_equal_forms(results, expected, tuple(map(len, arrays)))


def assert_equal_forms(results, expected, shape=(-1,)):
    """Assert that an array, or a tuple of arrays, equals the scalar form's, in a few ulps."""
    results = np.stack(results, axis=-1) if isinstance(results, tuple) else results
    assert shape == (-1,) or results.shape[:len(shape)] == shape
    expected = np.array(expected)
    results = results.reshape(-1, *expected.shape[1:])
    assert results.shape == expected.shape
    scale = np.abs(expected).reshape(len(expected), -1).max(axis=-1)
    errors = np.abs(results - expected).reshape(len(expected), -1).max(axis=-1)
    assert (errors <= 1e-15 * np.maximum(scale, 1e-300) * 8).all()
