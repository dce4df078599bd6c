# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``tf_share`` as a process that reports its cost: ``python -m benchmark.processes.sharer``."""

import time

import rclpy
from tf_tree_py.nodes.tf_share import TfShare

from ..worker import serve


class Sharer:
    """A shared tree, and the CPU of its process."""

    def __init__(self) -> None:
        self.node = TfShare()
        self._began = self._used = 0.0

    def begin(self) -> None:
        """Begin to measure."""
        self._began, self._used = time.monotonic(), time.process_time()

    def cores(self) -> float:
        """Return how many cores were used since ``begin``."""
        return (time.process_time() - self._used) / (time.monotonic() - self._began)


def main() -> None:
    """Share until the input ends."""
    rclpy.init()
    sharer = Sharer()
    serve({'begin': sharer.begin, 'cores': sharer.cores})
    sharer.node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
