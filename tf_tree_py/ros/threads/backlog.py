# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Long jobs of a thread, done in steps, so that its short jobs need not wait for them.

There is no lock: the thread that adds the jobs, a listener's, also does them.
"""

from collections import deque
from collections.abc import Iterator

from tf_tree_py.core.errors import no_truth


class Backlog:
    """
    Jobs that wait for their turn; each is an iterator that does one step at a time.

    The length is the number of jobs. Not thread-safe.
    """

    def __init__(self, most_bytes: int) -> None:
        """
        Begin without jobs.

        :param most_bytes: of the waiting messages; while there are more, ``add`` does steps.
        """
        self._most_bytes = most_bytes
        self._jobs: deque[tuple[Iterator[None], int]] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._jobs)

    __bool__ = no_truth

    def add(self, job: Iterator[None], size: int) -> None:
        """Add a job, whose message has this many bytes; no job is ever dropped."""
        self._jobs.append((job, size))
        self._bytes += size
        while self._bytes > self._most_bytes:
            self.step()

    def step(self) -> bool:
        """
        Do one step of the oldest job; return whether any job is left.

        A job that raises an exception is over.
        """
        if not self._jobs:
            return False
        job, size = self._jobs[0]
        is_over = True
        try:
            is_over = next(job, self) is self
        finally:
            if is_over:
                self._jobs.popleft()
                self._bytes -= size
        return bool(self._jobs)
