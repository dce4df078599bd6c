"""Counting calls: which way something went, where the answers do not tell."""

from collections import Counter
from contextlib import contextmanager
import sys


@contextmanager
def calls():
    """Count the calls of every function; whoever calls it, by whatever name."""
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
