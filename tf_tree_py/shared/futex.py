# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for a word of shared memory to change: the system call futex, which Python does not have.

One call wakes all processes that wait, and they may have mapped the memory for reading only.
"""

import ctypes
import errno
import platform
import time

import numpy as np

_WAIT, _WAKE, _ALL = 0, 1, 2 ** 31 - 1
# The value has changed, a signal came, and the time is up.
_EXPECTED = (errno.EAGAIN, errno.EINTR, errno.ETIMEDOUT)
# How often to look at the word where the system does not allow the call, seconds.
_LOOK_S = 0.005

# The first lets other threads of Python run; the second does not, because it only takes a moment.
_wait = ctypes.CDLL(None, use_errno=True).syscall
_wake = ctypes.PyDLL(None).syscall


class _Timespec(ctypes.Structure):
    """A duration for the system."""

    _fields_ = (('seconds', ctypes.c_long), ('nanoseconds', ctypes.c_long))


class Futex:
    """
    The lower half of a word in memory.

    :cvar number: of the system call.
    """

    number = {'x86_64': 202, 'AMD64': 202, 'aarch64': 98}.get(platform.machine(), -1)

    def __init__(self, words: 'memoryview[int]', index: int) -> None:
        """
        Use a word.

        :param words: 64-bit integers, with the lower half first.
        """
        self._words = words  # or else the memory might be unmapped
        self._index = index
        self._address = ctypes.c_void_p(
            np.frombuffer(words, np.int64).ctypes.data + index * words.itemsize)
        self._arguments = ctypes.c_long(self.number), self._address, _WAKE, _ALL, None, None, 0

    def wait(self, value: int, timeout_s: float) -> None:
        """
        Block until the word may have changed.

        :param value: of the whole word, when it was last looked at.
        :param timeout_s: at most so long, seconds.
        """
        duration = _Timespec(int(timeout_s), int(timeout_s % 1.0 * 1e9))
        failed = _wait(ctypes.c_long(self.number), self._address, _WAIT,
                       ctypes.c_uint32(value & 0xffffffff), ctypes.byref(duration), None, 0)
        if failed and ctypes.get_errno() not in _EXPECTED:
            end = time.monotonic() + timeout_s
            while self._words[self._index] == value and time.monotonic() < end:
                time.sleep(_LOOK_S)

    def wake_all(self) -> None:
        """Wake all that wait, in all processes."""
        _wake(*self._arguments)
