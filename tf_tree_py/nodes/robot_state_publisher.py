# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``urdf_broadcaster`` under the name in existing launch files, which change only the package."""

from collections.abc import Sequence
import sys

from . import urdf_broadcaster

NAME = 'robot_state_publisher'


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    return urdf_broadcaster.main(argv, NAME)


if __name__ == '__main__':
    sys.exit(main())
