"""
Robot descriptions without ROS: a URDF, and where its links are at given positions.

Nothing is published here, nothing is drawn, and no mesh is looked for.
"""

from .elements import DescriptionError
from .joints import Joint, Mimic
from .robot import Robot
from .tracks import joint_tracks, JointState
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
