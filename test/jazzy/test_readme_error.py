# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of tf2_ros in README is what it raises for the samples and the mistake of README."""

from pathlib import Path
import re

from standin import run_with_tf2

README = Path(__file__).parents[2] / 'README.md'
# The samples of README's first program.
PROGRAM = """
from rclpy.time import Time
from tf2_ros import Buffer, TransformException
from tf_tree_py import Pose, transform_stamped

buffer = Buffer()
for stamp in range(1_000_000_000, 2_000_000_001, 20_000_000):
    pose = Pose.from_xyz_rpy(x=0.5e-9 * stamp, yaw=0.5)
    buffer.set_transform(transform_stamped('map', 'base', stamp, pose), 'test')
buffer.set_transform_static(transform_stamped('base', 'camera', 0, Pose(x=0.2, z=0.8)), 'test')
try:
    buffer.lookup_transform('map', 'camera', Time(nanoseconds=2_050_000_000))
except TransformException as error:
    print(error)
"""


def test_error_of_tf2_is_quoted():
    quoted = re.findall(r'```text\n(Lookup would[^`]*)```', README.read_text())[-1]
    # README wraps the lines.
    assert run_with_tf2(PROGRAM).split() == quoted.split()
