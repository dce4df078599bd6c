# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The installed tf_transformations; otherwise the names in tf_tree_py, backed by scipy."""

import math

import numpy
from tf_tree_py.dropin import rarer_matrices, transformations
from tf_tree_py.dropin.installed_first import is_installed

__all__ = [
    'Arcball',
    'arcball_constrain_to_axis',
    'arcball_map_to_sphere',
    'arcball_nearest_axis',
    'clip_matrix',
    'compose_matrix',
    'concatenate_matrices',
    'decompose_matrix',
    'euler_from_matrix',
    'euler_from_quaternion',
    'euler_matrix',
    'identity_matrix',
    'inverse_matrix',
    'is_same_transform',
    'math',
    'numpy',
    'orthogonalization_matrix',
    'projection_from_matrix',
    'projection_matrix',
    'quaternion_about_axis',
    'quaternion_conjugate',
    'quaternion_from_euler',
    'quaternion_from_matrix',
    'quaternion_inverse',
    'quaternion_matrix',
    'quaternion_multiply',
    'quaternion_slerp',
    'random_quaternion',
    'random_rotation_matrix',
    'random_vector',
    'reflection_from_matrix',
    'reflection_matrix',
    'rotation_from_matrix',
    'ROTATION_IDENTITY',
    'rotation_matrix',
    'scale_from_matrix',
    'scale_matrix',
    'shear_from_matrix',
    'SHEAR_IDENTITY',
    'shear_matrix',
    'superimposition_matrix',
    'translation_from_matrix',
    'TRANSLATION_IDENTITY',
    'translation_matrix',
    'unit_vector',
    'vector_norm',
    'ZOOM_IDENTITY',
]

if not is_installed(__name__):
    _HOMES = {**vars(transformations), **vars(rarer_matrices)}
    # A star import of the original includes these; programs import the private names, too.
    _OF_PYTHON = ('math', 'numpy')
    globals().update({name: _HOMES[name] for name in (*__all__, '_AXES2TUPLE', '_TUPLE2AXES')
                      if name not in _OF_PYTHON})
