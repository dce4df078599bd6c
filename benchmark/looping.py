# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A loop at a fixed rate that looks something up in each turn, and what it costs."""

from collections.abc import Callable
import time
from typing import Any

import numpy as np


def run_loop(prepare: Callable[[int], Any], ask: Callable[[Any], object], rate_hz: float,
             seconds: float) -> dict[str, float]:
    """
    Look up at a rate; return the measurements.

    :param prepare: returns what to ask in a turn, by its number; its time does not count.
    """
    count = round(seconds * rate_hz)
    late, spent, unanswered = [], [], 0
    used, begin = time.process_time(), time.monotonic()
    for number in range(count):
        due = begin + number / rate_hz
        time.sleep(max(0.0, due - time.monotonic()))
        woken = time.monotonic()
        question = prepare(number)
        asked = time.perf_counter()
        try:
            ask(question)
            spent.append(time.perf_counter() - asked)
        except Exception:  # noqa: B902 - each package has its own classes
            unanswered += 1
        late.append(woken - due)
    lasted = time.monotonic() - begin
    median, most, nearly_all = np.percentile(spent or [np.nan], [50.0, 99.0, 99.9])
    return {'p50_s': float(median), 'p99_s': float(most), 'p999_s': float(nearly_all),
            'late_p99_s': float(np.percentile(late, 99.0)), 'unanswered': unanswered / count,
            'cores': (time.process_time() - used) / lasted}
