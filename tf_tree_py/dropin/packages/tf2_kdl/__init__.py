# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The installed tf2_kdl: it uses PyKDL, so tf_tree_py has no replacement."""

from tf_tree_py.dropin.installed_first import is_installed

if not is_installed(__name__):
    raise ModuleNotFoundError(
        'tf2_kdl is not installed, and tf_tree_py does not replace it: it needs PyKDL, which is '
        'not on PyPI. Install ROS 2 with ros-$ROS_DISTRO-tf2-kdl; or do without KDL: '
        'tf_tree_py.as_matrix(transform) is what KDL.Frame holds, as a 4x4 array, and '
        'tf_tree_py.as_pose(transform) @ points moves points', name=__name__)
