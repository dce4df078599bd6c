# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Robot descriptions without ROS: reads a URDF and computes the poses of its links.

This package does not publish or draw, and it does not read meshes.
"""

from .joint_states import joint_tracks, JointState
from .joints import Joint, Mimic
from .robot import Robot
from .robot_xml import DescriptionError
from .visuals import Box, Cylinder, Mesh, Sphere, Visual

__all__ = [
    'Box',
    'Cylinder',
    'DescriptionError',
    'Joint',
    'joint_tracks',
    'JointState',
    'Mesh',
    'Mimic',
    'Robot',
    'Sphere',
    'Visual',
]
