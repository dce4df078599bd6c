"""The name that launch files have for ``urdf_broadcaster``: they change the package alone."""

from collections.abc import Sequence
import sys

from . import urdf_broadcaster

NAME = 'robot_state_publisher'


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    return urdf_broadcaster.main(argv, NAME)


if __name__ == '__main__':
    sys.exit(main())
