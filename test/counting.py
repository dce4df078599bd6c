# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Count calls, where the results do not show which way the code went."""

from collections import Counter
from contextlib import contextmanager
import sys


@contextmanager
def calls():
    """Count the calls of every function, from any caller and under any name."""
    counted = Counter()

    def count(frame, event, _):
        if event == 'call':
            counted[frame.f_code] += 1

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        yield lambda function: counted[function.__code__]
    finally:
        sys.setprofile(before)
