# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The keywords of a static transform, and the text of its numbers."""

import re

FRAMES = ('frame_id', 'child_frame_id')
TRANSLATION = ('x', 'y', 'z')
QUATERNION = ('qx', 'qy', 'qz', 'qw')
ANGLES = ('roll', 'pitch', 'yaw')
NUMBERS = (*TRANSLATION, *QUATERNION, *ANGLES)
COVARIANCE = 'covariance'
WORDS = (*FRAMES, *NUMBERS, COVARIANCE)

# The text of a number. Python also reads 1_000, and digits of other scripts.
DECIMAL = re.compile(r'[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?')
