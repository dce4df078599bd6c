# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure the age of some robots' newest poses in a plain subscription, as a reference.

Run ``python -m benchmark.processes.fleet_reference ROUTER KEYS``. A listener's delay that also
appears here is caused by the machine: a robot, a router or a reader had no CPU time.
"""

import struct
import sys
import threading
import time

from tf_tree_py.fleet import configuration, open_session
import zenoh

from ..worker import serve

_FIRST_STAMP = struct.Struct('<8xiI')
_LOOK_S = 0.1


class Ages:
    """The age of the oldest of the robots' newest stamps, measured ten times a second."""

    def __init__(self) -> None:
        self._newest: dict[str, float] = {}
        self._ages: list[tuple[float, float]] = []
        threading.Thread(target=self._look, daemon=True).start()

    def receive(self, sample: zenoh.Sample) -> None:
        """Store the stamp of a message."""
        seconds, nanoseconds = _FIRST_STAMP.unpack_from(sample.payload.to_bytes())
        self._newest[str(sample.key_expr)] = seconds + 1e-9 * nanoseconds

    def looks(self) -> list[tuple[float, float]]:
        """Return the times (monotonic clock) and ages measured since the last call."""
        looks, self._ages = self._ages, []
        return looks

    def _look(self) -> None:
        while True:
            time.sleep(_LOOK_S)
            oldest = min(self._newest.copy().values(), default=None)
            if oldest is not None:
                self._ages.append((time.monotonic(), time.time() - oldest))


if __name__ == '__main__':
    ages = Ages()
    with open_session(configuration(sys.argv[1]), 10.0) as session:
        subscriber = session.declare_subscriber(sys.argv[2], ages.receive)
        serve({'looks': ages.looks})
