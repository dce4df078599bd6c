# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The resources that processes use in long runs, and whether they level off."""

from collections.abc import Sequence
import os
from pathlib import Path
from typing import NamedTuple

MB = 2**20
# The limits of the last third of a run: a multiple of the second third, and an increase.
MORE_MEMORY, MORE_THREADS = 1.15, 3


class Use(NamedTuple):
    """
    The resources that a process uses.

    :ivar memory: resident, bytes.
    """

    memory: int
    threads: int
    descriptors: int

    def __str__(self) -> str:
        return (f'{self.memory / MB:.0f} MB, {self.threads} threads, '
                f'{self.descriptors} descriptors')


def use_of(pid: int) -> Use:
    """Return the current resource usage of a process, as counted by Linux."""
    status = dict(line.split(':', 1) for line in
                  Path(f'/proc/{pid}/status').read_text().splitlines() if ':' in line)
    return Use(1024 * int(status['VmRSS'].split()[0]), int(status['Threads']),
               len(os.listdir(f'/proc/{pid}/fd')))


def cpu_s_of(pid: int) -> float:
    """Return the CPU time of a process, user and system, seconds."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def levels_off(name: str, uses: Sequence[Use]) -> bool:
    """Print and return whether the last third of a run uses no more than the second."""
    third = len(uses) // 3
    before, after = (Use(*map(max, zip(*part, strict=True)))
                     for part in (uses[third:2 * third], uses[2 * third:]))
    level = (after.memory <= MORE_MEMORY * before.memory
             and after.threads <= before.threads + MORE_THREADS
             and after.descriptors <= before.descriptors + MORE_THREADS)
    print(f'{name}: {before}, then {after}: {"level" if level else "it grows"}', flush=True)
    return level
