"""The recorded answers of tf2's C++ buffer, replayed operation by operation."""

import json
import math
from pathlib import Path

import pytest
from tf_tree_py import core
from tf_tree_py.core import BufferCore, TransformException

RECORDINGS = sorted((Path(__file__).parent.parent / 'data' / 'conformance').glob('*.jsonl'))


def pose_of(operation):
    numbers = (*operation['translation'], *operation['rotation'])
    return tuple(math.nan if number is None else number for number in numbers)


class Replay:
    """One buffer, and the recording's operations as calls on it."""

    def run(self, operation):
        return getattr(self, 'run_' + operation['op'])(operation)

    def run_new(self, operation):
        self.buffer = BufferCore(operation['cache_time'])

    def run_set(self, operation):
        self.buffer.insert(operation['parent'], operation['child'], operation['stamp'],
                           pose_of(operation), authority=operation['authority'],
                           static=operation['static'])

    def run_clear(self, operation):
        self.buffer.clear()

    def run_lookup(self, operation):
        return self.buffer.lookup_stamped(
            operation['target'], operation['source'], operation['time'])

    def run_lookup_full(self, operation):
        return self.buffer.lookup_full_stamped(
            operation['target'], operation['target_time'], operation['source'],
            operation['source_time'], operation['fixed'])

    def run_can(self, operation):
        try:
            self.run_lookup(operation)
        except TransformException:
            return False
        return True

    def run_latest_common_time(self, operation):
        return self.buffer.latest_common_time(operation['target'], operation['source'])


def difference(operation, answer):
    """Return how an answer differs from the recorded one; '' if it does not."""
    expected = operation['result']
    if not isinstance(expected, dict):
        return '' if answer == expected else f'{answer} instead of {expected}'
    stamp, pose = answer
    if stamp != expected['stamp']:
        return f'stamp {stamp} instead of {expected["stamp"]}'
    if any(abs(a - b) > 1e-9 for a, b in zip(pose[:3], expected['translation'], strict=True)):
        return f'translation {pose[:3]} instead of {expected["translation"]}'
    rotation, recorded = pose[3:], expected['rotation']
    if not any(all(abs(sign * a - b) <= 1e-9 for a, b in zip(rotation, recorded, strict=True))
               for sign in (1.0, -1.0)):
        return f'rotation {rotation} instead of {recorded}'
    return ''


@pytest.mark.parametrize('recording', RECORDINGS, ids=lambda path: path.stem)
def test_answers_are_those_of_tf2(recording):
    replay = Replay()
    problems = []
    answers = 0
    for number, line in enumerate(recording.read_text().splitlines(), 1):
        operation = json.loads(line)
        answers += 'error' in operation or 'result' in operation
        try:
            answer = replay.run(operation)
        except TransformException as error:
            expected = operation.get('error')
            if expected is None or not isinstance(error, getattr(core, expected)):
                problems.append(f'line {number}: {type(error).__name__}: {error}: {operation}')
            continue
        if 'error' in operation:
            problems.append(f'line {number}: {answer} instead of an error: {operation}')
        elif 'result' in operation:
            problem = difference(operation, answer)
            if problem:
                problems.append(f'line {number}: {problem}: {operation}')
    assert answers > 0
    assert not problems, f'{len(problems)} of {answers} differ\n' + '\n'.join(problems[:5])


def test_every_family_is_replayed():
    assert len(RECORDINGS) == 14
