# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Single lookups: over depth, over history, on a humanoid, and of a whole tree."""

from collections.abc import Iterator

from ..effort import Effort
from ..exercise import Task
from ..peers.finding import Contestants
from ..rows import COMPILED, CORE, DEBIAN, JAZZY, OURS, Row, scaled, TF2_ROS
from ..timing import interleave

# Lookup time as a multiple of C++ tf2's, by depth; None is measured for the plot only.
_MIDDLE = {1: 1.0, 2: 1.4, 3: None, 5: 2.5, 10: 4.0, 15: None, 38: 10.0}
_LATEST = {1: 0.8, 2: 1.0, 3: None, 5: 1.5, 10: 2.2, 15: None, 38: None}
# Of compiled formulas, as a multiple of tf2_ros's: the stamps of a control loop, which waits for
# no sample, and the latest of a robot that publishes all edges in one message.
_COMPILED_RECENT = {1: 0.35, 2: None, 3: None, 5: 0.7, 10: 1.0, 15: None, 38: 2.5}
_COMPILED_LATEST = dict.fromkeys((1, 5, 10, 38), 0.45)
_RECENT_S = 0.03
_LONGER_HISTORY = 1.2
_HUMANOID = 1.3
_WHOLE_TREE = 6.0

_HISTORY_S = 1.0


def depths(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups over depth, with an insertion between every two."""
    count = effort.lookups
    for depth, target in _MIDDLE.items():
        yield _depth(contestants, effort, 'middle',
                     Task(f'chain{depth}', _HISTORY_S, False, count), target)
    for depth, target in _LATEST.items():
        yield _depth(contestants, effort, 'latest',
                     Task(f'chain{depth}', _HISTORY_S, True, count), target)
    for depth, target in _COMPILED_LATEST.items():
        # Fewer, because many insertions take long.
        task = Task(f'chain{depth}', _HISTORY_S, True, count // 4, whole_message=True)
        yield _depth(contestants, effort, 'latest of one message', task, None, target)
    for depth, target in _COMPILED_RECENT.items():
        task = Task(f'chain{depth}', _HISTORY_S, False, count, age_s=_RECENT_S)
        yield _depth(contestants, effort, '30 ms old', task, None, target)


def _depth(contestants: Contestants, effort: Effort, where: str, task: Task,
           target: float | None, compiled_target: float | None = None) -> Row:
    """Measure one kind of lookup; the targets are those of DEBIAN and of TF2_ROS."""
    turns = {name: exercise.take_turn for name, exercise in contestants.exercises(task).items()}
    row = Row('depth', f'{where}, depth {task.robot.removeprefix("chain")}', 'us',
              scaled(interleave(turns, effort.rounds), 1e6))
    row.compare(OURS, DEBIAN, target)
    row.compare(OURS, TF2_ROS)
    row.compare(OURS, JAZZY)
    row.compare(COMPILED, TF2_ROS, compiled_target, name=f'{row.name}: {COMPILED}')
    return row


def histories(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups in the middle of increasingly long histories."""
    for depth in 1, 5:
        turns = {
            f'{name}, {seconds:.0f} s': exercise.take_turn
            for seconds in (1.0, 10.0, 60.0)
            for name, exercise in contestants.exercises(
                Task(f'chain{depth}', seconds, False, effort.lookups),
                (OURS, DEBIAN, JAZZY)).items()
        }
        row = Row('history', f'middle, depth {depth}', 'us',
                  scaled(interleave(turns, effort.rounds), 1e6))
        row.compare(f'{OURS}, 60 s', f'{OURS}, 1 s', _LONGER_HISTORY,
                    name=f'{row.name}: 60 s of history', unit='x 1 s of it')
        row.compare(f'{OURS}, 10 s', f'{DEBIAN}, 10 s', name=f'{row.name}: 10 s of history')
        yield row


def humanoid(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the pose of a hand camera in the map: 12 edges, 5 of them moving."""
    turns = {
        f'{name}, {label}': exercise.take_turn
        for robot, label in (('chain5', 'chain of 5'), ('humanoid', 'hand camera'))
        for name, exercise in contestants.exercises(
            Task(robot, _HISTORY_S, False, effort.lookups), (OURS, CORE, DEBIAN, JAZZY)).items()
    }
    row = Row('humanoid', 'middle', 'us', scaled(interleave(turns, effort.rounds), 1e6))
    row.compare(f'{OURS}, hand camera', f'{OURS}, chain of 5', _HUMANOID,
                name='hand camera of the humanoid', unit='x the chain of 5')
    row.compare(f'{OURS}, hand camera', f'{DEBIAN}, hand camera',
                name='hand camera of the humanoid')
    yield row


def whole_tree(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the poses of all frames of the humanoid relative to one."""
    count = max(1, effort.lookups // 10)
    one = contestants.exercises(Task('chain5', _HISTORY_S, False, effort.lookups), (OURS,))[OURS]
    trees = contestants.exercises(
        Task('humanoid', _HISTORY_S, False, count, whole_tree=True), (OURS, DEBIAN, JAZZY))
    turns = {name: exercise.take_turn for name, exercise in trees.items()}
    turns['one lookup of depth 5'] = one.take_turn
    row = Row('tree', 'all frames, middle', 'us', scaled(interleave(turns, effort.rounds), 1e6))
    row.compare(OURS, 'one lookup of depth 5', _WHOLE_TREE, name='all frames of the humanoid')
    row.compare(OURS, DEBIAN, name='all frames of the humanoid', unit='x a loop of C++ tf2')
    yield row
