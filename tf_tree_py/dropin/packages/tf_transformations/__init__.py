# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The installed tf_transformations; otherwise the names in tf_tree_py, backed by scipy."""

from tf_tree_py.dropin import transformations
from tf_tree_py.dropin.installed_first import is_installed

__all__ = [
    'concatenate_matrices',
    'euler_from_matrix',
    'euler_from_quaternion',
    'euler_matrix',
    'identity_matrix',
    'inverse_matrix',
    'is_same_transform',
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
    'reflection_matrix',
    'rotation_from_matrix',
    'rotation_matrix',
    'scale_matrix',
    'translation_from_matrix',
    'translation_matrix',
    'unit_vector',
    'vector_norm',
]

if not is_installed(__name__):
    globals().update({name: getattr(transformations, name) for name in __all__})


def __getattr__(name: str) -> object:
    raise AttributeError(
        f'tf_transformations of tf_tree_py has no {name!r}: it has rotations, translations and '
        'scalings. Install ros-$ROS_DISTRO-tf-transformations for the rest')
