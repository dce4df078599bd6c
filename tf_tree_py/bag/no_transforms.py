# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of a bag without transforms: its topics, and which of them can give transforms."""

from tf_tree_py.core.text import listed

from .files.bag_reader import Bag
from .joints import JOINT_STATES

_ODOMETRY, _TF_MESSAGE = 'nav_msgs/Odometry', 'tf2_msgs/TFMessage'


def no_transforms(bag: Bag) -> str:
    """Return the error in one sentence; the bag must be open and not yet read."""
    types = {source.topic: source.type_name.replace('/msg/', '/') for source in bag.everything}
    there = listed(sorted(types), most=20) or 'nothing'
    hints = [f'{topic} has messages of type {kind}, not {_TF_MESSAGE}'
             for topic, kind in types.items()
             if topic.rpartition('/')[2] in ('tf', 'tf_static')
             and kind not in (_TF_MESSAGE, 'tf/tfMessage')]
    for topic, kind in types.items():
        if kind == _ODOMETRY:
            hints.append(f'open_bag(..., odometry={topic!r}) makes an edge of its odometry, as '
                         'Covariances(with_poses=True) does')
        elif kind == JOINT_STATES:
            hints.append(f'open_bag(..., robot="robot.urdf") makes edges of the joint states '
                         f'of {topic}')
    return '; '.join([f'{bag.path} has no topic with transforms; it has: {there}', *hints,
                      *bag.damage])
