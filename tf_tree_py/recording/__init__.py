# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Bags that this package writes: of a whole buffer, or of the messages before an incident.

No ROS is needed; rosbags (``pip install rosbags``) writes the files. ``bag`` reads them.
"""
