# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Samples that go to and fro, sample by sample in plain Python: what ``Turns`` does with arrays.

A sample is a tuple of its stamp and its arrival, nanoseconds, and a pose of seven numbers with
a unit quaternion.
"""

from collections import Counter
from itertools import pairwise
import math
from statistics import median

import numpy as np
from tf_tree_py.health.measures.sample_rows import Rows

SECOND = 10**9


def rows_of(samples):
    stamps, received, poses = zip(*samples, strict=True)
    return Rows(np.array(received, np.int64), np.array(stamps, np.int64),
                np.array(poses, float).T.copy())


def length(vector):
    return math.sqrt(sum(number * number for number in vector))


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def apart(a, b):
    """Return the translation and the rotation from one pose to another."""
    less = length(minus(a[3:], b[3:]))
    more = length([x + y for x, y in zip(a[3:], b[3:], strict=True)])
    return length(minus(a[:3], b[:3])), 4.0 * math.atan2(min(less, more), max(less, more))


def size(vector):
    return length(vector[:3]) + length(vector[3:])


def points_of(samples):
    """Return positions and doubled quaternions, each on the side of the one before."""
    points = []
    for _, _, pose in samples:
        q = pose[3:]
        if points and dot(q, points[-1][3:]) < 0.0:
            q = [-number for number in q]
        points.append([*pose[:3], *(2.0 * number for number in q)])
    return points


def aside_of(before, after, points):
    line, aside = minus(points[2], points[0]), minus(points[1], points[0])
    part = dot(aside, line) / (dot(line, line) or 1.0)
    implied = 0.5
    if before >= 0 and after >= 0 and before + after > 0:
        implied = before / (before + after)
    best = implied if abs(part - implied) < abs(part - 0.5) else 0.5
    return [x - best * y for x, y in zip(aside, line, strict=True)]


class NaiveTurns:
    """The results of ``Turns``, from all samples at once."""

    def __init__(self, samples):
        self.sizes, self.received, examined = [], [], []
        points = points_of(samples)
        asides = {place: aside_of(samples[place][0] - samples[place - 1][0],
                                  samples[place + 1][0] - samples[place][0],
                                  points[place - 1:place + 2])
                  for place in range(1, len(samples) - 1)}
        for place in range(2, len(samples) - 2):
            before, here, after = (sample[2] for sample in samples[place - 1:place + 2])
            turn = self.is_turn(before, here, after, [
                asides[place + offset] for offset in (-1, 0, 1)])
            alone = size(asides[place]) > 0.75 * max(size(asides[place - 1]),
                                                     size(asides[place + 1]))
            if turn:
                self.sizes.append(size(asides[place]))
                self.received.append(samples[place][1])
            if self.sizes:
                examined.append((*samples[place][:2], points[place], turn and alone))
        self.all = len(self.sizes)
        self.first, self.last = (self.received[0], self.received[-1]) if self.all else (0, 0)
        self.intervals = intervals_of_blocks(examined)

    def is_turn(self, before, here, after, asides):
        (gone, turned), (gone_on, turned_on) = apart(before, here), apart(here, after)
        smaller = min(gone + turned, gone_on + turned_on)
        slow = turned < math.pi / 2 and turned_on < math.pi / 2
        if smaller <= 0.005 or size(asides[1]) <= 0.005 or not (slow or gone > 0.005):
            return False
        rest = [x + 0.5 * (y + z) for y, x, z in zip(*asides, strict=True)]
        return sum(apart(before, after)) < 0.3 * smaller or (
            slow and size(rest) < 0.3 * size(asides[1]))


def intervals_of_blocks(examined):
    last = None
    while len(examined) >= 256:
        block, examined = examined[:256], examined[256:]
        if last is None or abs(block[0][0] - last) > SECOND:
            last = block[-1][0]
            found = intervals_of_two(block)
            if found:
                return found
    return intervals_of_two(examined)


# --- the tracks of two publishers

def intervals_of_two(examined):
    if sum(turn for *_, turn in examined) < 16:
        return None
    sides, side = [], False
    for place, (*_, turn) in enumerate(examined):
        side ^= turn or (place > 0 and examined[place - 1][3])
        sides.append(side)
    stamps = [stamp for stamp, *_ in examined]
    wrong = len(stamps) - len(set(stamps)) + sum(b < a for a, b in pairwise(stamps))
    found = tracks([(sample[0], sample[2], side)
                    for sample, side in zip(examined, sides, strict=True)])
    if not found and wrong > 0.05 * len(stamps):
        found = tracks([(sample[1], sample[2], side)
                        for sample, side in zip(examined, sides, strict=True)])
    return found


def tracks(samples):
    samples.sort(key=lambda sample: sample[0])
    times, points, sides = zip(*samples, strict=True)
    for one in (sides, nearest(points), at_most_common(points)):
        found = regular(times, points, one)
        if found:
            return found
    return None


def nearest(points):
    steps = [length(minus(a, b)) for a, b in pairwise(points)]
    begin = steps.index(max(steps)) + 1
    sides = {begin - 1: False, begin: True}
    for places in (range(begin - 2, -1, -1), range(begin + 1, len(points))):
        last = {False: points[begin - 1], True: points[begin]}
        for place in places:
            side = squared(points[place], last[True]) < squared(points[place], last[False])
            sides[place], last[side] = side, points[place]
    return [sides[place] for place in range(len(points))]


def squared(a, b):
    """Return the square of the distance; q and -q are one rotation."""
    return dot(minus(a[:3], b[:3]), minus(a[:3], b[:3])) + min(
        sum((x - sign * y) ** 2 for x, y in zip(a[3:], b[3:], strict=True)) for sign in (-1, 1))


def at_most_common(points):
    rounded = [tuple(round(number / 0.001) * (-1 if place > 2 and round(point[6] / 0.001) < 0
                                              else 1) for place, number in enumerate(point))
               for point in points]
    counts = Counter(rounded)
    most = min(counts, key=lambda pose: (-counts[pose], pose))
    return [pose == most for pose in rounded]


def spread(times):
    steps = sorted(b - a for a, b in pairwise(times))
    last = len(steps) - 1
    low, usual, high = (steps[round(part * last)] for part in (0.1, 0.5, 0.9))
    return usual, high - low


def regular(times, points, sides):
    both = [[place for place, each in enumerate(sides) if each is side] for side in (True, False)]
    more, fewer = both if len(both[0]) > len(both[1]) else both[::-1]
    if len(fewer) < 8:
        return None
    first, varies = spread([times[place] for place in more])
    second, of_second = spread([times[place] for place in fewer])
    usual, together = spread(times)
    added = varies < 0.5 * together and together > 0.1 * usual and of_second < 0.75 * second
    alternate = sum(a != b for a, b in pairwise(sides)) > 0.7 * len(sides)
    still, moving = sorted(extent([points[place] for place in places]) for places in both)
    returns = still < 0.001 and moving > 0.02
    steps = median(length(minus(a[:3], b[:3])) for a, b in pairwise(points))
    # To and fro at this rate, with half the step as the amplitude.
    shaken = 0.5 * steps * (math.pi * 1e9) ** 2 > 3000.0 * usual ** 2
    return (first, second) if added or alternate and (returns or shaken) else None


def extent(points):
    points = [[*point[:3], *(number * (-1 if dot(point[3:], points[0][3:]) < 0 else 1)
                             for number in point[3:])] for point in points]
    return sum(max(column) - min(column) for column in zip(*points, strict=True))
