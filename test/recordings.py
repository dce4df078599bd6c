# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Replay the recorded results of tf2's C++ buffer, operation by operation.

Against the core and against messages; only the calls of the buffer differ. It imports nothing
of the package, because the heart answers alone, too.
"""

from collections.abc import Iterator
import json
import math
from pathlib import Path

RECORDINGS = sorted((Path(__file__).parent / 'data' / 'conformance').glob('*.jsonl'))

TOLERANCE = 1e-9


def pose_of(operation):
    numbers = (*operation['translation'], *operation['rotation'])
    return tuple(math.nan if number is None else number for number in numbers)


class Replay:
    """
    One buffer, and the recording's operations as calls on it.

    :param cls: the class of the buffer.
    :param with_sign: the core's function for tf2's sign of a quaternion; the core itself has no
        preferred sign, messages get it by this function.
    """

    def __init__(self, cls, with_sign):
        self.cls, self.with_sign = cls, with_sign

    def run(self, operation):
        return getattr(self, 'run_' + operation['op'])(operation)

    def run_new(self, operation):
        self.buffer = self.cls(operation['cache_time'])

    def run_set(self, operation):
        self.buffer.insert(operation['parent'], operation['child'], operation['stamp'],
                           pose_of(operation), authority=operation['authority'],
                           static=operation['static'])

    def run_clear(self, operation):
        self.buffer.clear()

    def run_lookup(self, operation):
        return self.signed(*self.buffer.lookup_stamped(
            operation['target'], operation['source'], operation['time']))

    def run_lookup_full(self, operation):
        return self.signed(*self.buffer.lookup_full_stamped(
            operation['target'], operation['target_time'], operation['source'],
            operation['source_time'], operation['fixed']))

    def signed(self, stamp, pose):
        return stamp, (*pose[:3], *self.with_sign(pose[3:]))

    def run_can(self, operation):
        try:
            self.run_lookup(operation)
        except Exception as error:
            if 'TransformException' in class_names_of(error):
                return False
            raise
        return True

    def run_latest_common_time(self, operation):
        return self.buffer.latest_common_time(operation['target'], operation['source'])


def class_names_of(error):
    """Return the names of an error's classes."""
    return [cls.__name__ for cls in type(error).__mro__]


def problems_of(replay: Replay, recording: Path) -> tuple[int, list[str]]:
    """Return the number of results in a recording, and the differences of a replay from them."""
    answers, problems = 0, []
    for number, operation in _operations(recording):
        answers += 'error' in operation or 'result' in operation
        problem = _problem(replay, operation)
        if problem:
            problems.append(f'line {number}: {problem}: {operation}')
    return answers, problems


def _operations(recording: Path) -> Iterator[tuple[int, dict]]:
    for number, line in enumerate(recording.read_text().splitlines(), 1):
        yield number, json.loads(line)


def _problem(replay, operation):
    expected = operation.get('error')
    try:
        answer = replay.run(operation)
    except Exception as error:
        if expected in class_names_of(error):
            return ''
        return f'{type(error).__name__}: {error}'
    if expected is not None:
        return f'{answer} instead of an error'
    return difference(operation['result'], answer) if 'result' in operation else ''


def difference(expected, answer):
    """Return the difference of a result from the recorded one; '' if there is none."""
    if not isinstance(expected, dict):
        return '' if answer == expected else f'{answer} instead of {expected}'
    stamp, pose = answer
    if stamp != expected['stamp']:
        return f'stamp {stamp} instead of {expected["stamp"]}'
    if not _close(pose[:3], expected['translation']):
        return f'translation {pose[:3]} instead of {expected["translation"]}'
    rotation, recorded = pose[3:], expected['rotation']
    other_sign = [-value for value in recorded]
    if _close(rotation, recorded) or (is_next_to_a_tie(recorded) and _close(rotation, other_sign)):
        return ''
    return f'rotation {rotation} instead of {recorded}'


def is_next_to_a_tie(q):
    """Return whether rounding decides the sign of the quaternion that tf2 returns."""
    x, y, z, w = (value * value for value in q)
    middle, largest = sorted((x, y, z))[1:]
    return (abs(w - 0.25) < TOLERANCE
            or (w < 0.25 and largest - middle < TOLERANCE))


def _close(values, others):
    return all(abs(a - b) <= TOLERANCE for a, b in zip(values, others, strict=True))
