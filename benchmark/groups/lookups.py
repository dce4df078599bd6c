# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Single lookups: over depth, over history, on a humanoid, and of a whole tree."""

from collections.abc import Iterator

from ..effort import Effort
from ..exercise import Task
from ..peers.finding import Contestants
from ..rows import CORE, DEBIAN, JAZZY, OURS, PURE, Row, RUST, scaled, TF2_ROS
from ..timing import interleave

# The most that a lookup may take, as a multiple of another's: in the middle of the history of
# C++ tf2's; the latest, and the stamps of a control loop, which waits for no sample, of tf2_ros's;
# and of a plan's in Rust, over as many edges as a short chain has.
_OF_DEBIAN, _OF_TF2_ROS, _OF_RUST = 1.0, 0.2, 2.2
_SHORT_CHAIN = 10
_LONGER_HISTORY = 1.2
_HUMANOID = 1.3
_WHOLE_TREE = 6.0

_RECENT_S = 0.03
# The second is tf2's default.
_HISTORY_S, _LONG_HISTORY_S = 1.0, 10.0
_DEPTHS, _FEW_DEPTHS = (1, 2, 3, 5, 10, 15, 38), (1, 5, 10, 38)


def depths(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups over depth, with an insertion between every two."""
    # Of each kind: its name, its depths, and the task of any robot.
    latest = Task('', _HISTORY_S, True, effort.lookups)
    recent = Task('', _HISTORY_S, False, effort.lookups, age_s=_RECENT_S)
    of_10_s = f', {_LONG_HISTORY_S:.0f} s of history'
    # Fewer lookups, because many insertions take long.
    message = latest._replace(count=effort.lookups // 4, whole_message=True)
    for where, depths_of_kind, task in (
            ('middle', _DEPTHS, recent._replace(age_s=None)),
            ('latest', _DEPTHS, latest),
            (f'latest{of_10_s}', _FEW_DEPTHS, latest._replace(history_s=_LONG_HISTORY_S)),
            ('latest of one message', _FEW_DEPTHS, message),
            ('30 ms old', _DEPTHS, recent),
            (f'30 ms old{of_10_s}', _FEW_DEPTHS, recent._replace(history_s=_LONG_HISTORY_S))):
        for depth in depths_of_kind:
            yield _depth(contestants, effort, where, depth, task)


def _depth(contestants: Contestants, effort: Effort, where: str, depth: int, task: Task) -> Row:
    """Measure one kind of lookup over so many moving edges."""
    exercises = contestants.exercises(task._replace(robot=f'chain{depth}'))
    turns = {name: exercise.take_turn for name, exercise in exercises.items()}
    row = Row('depth', f'{where}, depth {depth}', 'us',
              scaled(interleave(turns, effort.rounds), 1e6))
    in_middle, short = where == 'middle', depth <= _SHORT_CHAIN
    row.compare(OURS, DEBIAN, _OF_DEBIAN if in_middle else None)
    row.compare(OURS, TF2_ROS, None if in_middle else _OF_TF2_ROS)
    row.compare(OURS, JAZZY)
    row.compare(CORE, RUST, _OF_RUST if short and not in_middle else None,
                name=f'{row.name}: {CORE}')
    row.compare(PURE, TF2_ROS, name=f'{row.name}: {PURE}')
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
