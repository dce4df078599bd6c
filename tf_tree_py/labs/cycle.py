# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two nodes each publish the other's frame as a child: the answers of tf2 and of this tree."""

from collections.abc import Mapping
from functools import partial
from itertools import permutations
from typing import NamedTuple

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.stamp import from_seconds

from .report import Axes, Column, Figure, GREY, Report, STYLES, Table

SUMMARY = "two nodes each claim to be the other's parent: who finds out, and when"

EKF, WHEELS = '/ekf', '/wheel_odometry'
ODOM_T_BASE = Pose(2.0, 0.0, 0.0)
BASE_T_ODOM = Pose(-2.3, 0.0, 0.0)
"""The pose from the second node: it should be the inverse of the first, but has drifted."""
BELOW = {'torso': ('base_link', Pose(0.1, 0.0, 0.4)), 'head': ('torso', Pose(0.1, 0.0, 0.5)),
         'camera': ('head', Pose(0.1, 0.0, 0.1)), 'dock': ('odom', Pose(0.5, 0.0, 0.0))}
"""The frames below the two, by child frame: four undisputed static edges."""

FRAMES = ('odom', 'base_link', 'torso', 'camera', 'dock')
STAMP = from_seconds(1.0)

# The number of edges after which tf2's BufferCore gives up.
_TF2_MAX_DEPTH = 1000

Tree = Mapping[str, tuple[str, Pose]]


class TooDeep(Exception):
    """tf2's error "The tf tree is invalid because it contains a loop"."""


def disputed() -> dict[str, tuple[str, Pose]]:
    """Return every frame's parent and pose as tf2 stores them, with the loop."""
    return {'base_link': ('odom', ODOM_T_BASE), 'odom': ('base_link', BASE_T_ODOM), **BELOW}


def tf2_lookup(tree: Tree, target: str, source: str) -> Pose:
    """
    Return ``target_T_source`` as tf2 computes it (BufferCore::walkToTopParent), loop or not.

    It climbs from the source to the target or the top, then from the target to the source
    or that top. It gives up after 1,000 edges.

    :raises TooDeep: it gave up, because it followed the loop.
    """
    if target == source:
        return Pose()
    frame, top_T_source = source, Pose()
    for _ in range(_TF2_MAX_DEPTH + 1):
        if frame == target:
            return top_T_source
        if frame not in tree:
            break
        frame, pose = tree[frame]
        top_T_source = pose @ top_T_source
    else:
        raise TooDeep
    top, frame, top_T_target = frame, target, Pose()
    for _ in range(_TF2_MAX_DEPTH + 1):
        if frame == source:
            return top_T_target.inverse()
        if frame == top:
            return top_T_target.inverse() @ top_T_source
        frame, pose = tree[frame]
        top_T_target = pose @ top_T_target
    raise TooDeep


class Pair(NamedTuple):
    """One lookup, in tf2 and here: x of ``target_T_source`` in metres, or None if it failed."""

    target: str
    source: str
    tf2: float | None
    here: float | None


def publish() -> tuple[BufferCore, list[Incident]]:
    """Insert the same into a buffer of this library, the loop last; return its incidents."""
    buffer = BufferCore()
    for child, (parent, pose) in BELOW.items():
        buffer.insert(parent, child, LATEST, pose, authority='/robot_state', static=True)
    incidents = buffer.insert('odom', 'base_link', STAMP, ODOM_T_BASE, authority=EKF)
    incidents += buffer.insert('base_link', 'odom', STAMP, BASE_T_ODOM, authority=WHEELS,
                               strict=False)
    return buffer, incidents


def ask(buffer: BufferCore) -> list[Pair]:
    """Look up every pair of frames in both."""
    tree = disputed()
    pairs = []
    for target, source in permutations(FRAMES, 2):
        try:
            tf2 = tf2_lookup(tree, target, source).x
        except TooDeep:
            tf2 = None
        pairs.append(Pair(target, source, tf2, _x(buffer, target, source)))
    return pairs


def _x(buffer: BufferCore, target: str, source: str) -> float | None:
    try:
        return buffer.lookup(target, source, LATEST).x
    except TransformException:
        return None


def run() -> Report:
    """Close the loop, and look up every pair of frames."""
    buffer, incidents = publish()
    pairs = ask(buffer)
    failed = [pair for pair in pairs if pair.tf2 is None]
    wrong = [pair for pair in pairs if pair.tf2 is not None and pair.here is not None
             and abs(pair.tf2 - pair.here) > 1e-9]
    there, back = (next(pair.tf2 for pair in pairs if pair[:2] == names)
                   for names in (('odom', 'base_link'), ('base_link', 'odom')))
    assert there is not None and back is not None
    return Report(
        tables=[_table(pairs)],
        law=f'of {len(pairs)} lookups in a tree with a loop tf2 fails {len(failed)}, even if '
            'the loop is not on the path, and answers the others without an error, '
            f'{len(wrong)} of them with the pose of the second node; this tree refuses the edge '
            f'that closes the loop when it arrives, and answers all {len(pairs)}.',
        remarks=[
            f'In tf2 odom <- base_link is {there:.1f} m and base_link <- odom is {back:.1f} m: '
            'they are not inverses of each other, because each direction uses the pose of another '
            'node. And camera <- torso, over two undisputed static edges, fails with a depth '
            'error: the climb from the source to the target never ends.',
            'The warning of this tree, once, when the edge arrives:\n'
            + '\n'.join(map(str, incidents))],
        numbers={'pairs': len(pairs), 'tf2_failed': len(failed), 'tf2_by_the_second': len(wrong),
                 'here_failed': sum(pair.here is None for pair in pairs),
                 'tf2_there_m': there, 'tf2_back_m': back,
                 'incidents': [str(incident) for incident in incidents]},
        draw=partial(_draw, pairs))


def _table(pairs: list[Pair]) -> Table:
    return Table(
        'x of every pair: /ekf sends odom -> base_link, /wheel_odometry sends base_link -> odom',
        (Column('target', 'target'), Column('source', 'source'),
         Column('tf2_x_m', 'tf2 [m]', '.2f'), Column('here_x_m', 'this tree [m]', '.2f'),
         Column('note', '')),
        [(*pair, _note(pair)) for pair in pairs])


def _note(pair: Pair) -> str:
    if pair.tf2 is None:
        return 'tf2: more than 1000 deep'
    agree = pair.here is not None and abs(pair.tf2 - pair.here) < 1e-9
    return '' if agree else 'tf2: by the second node'


_PLACES = {'odom': (1.0, 3.8), 'dock': (2.5, 3.8), 'base_link': (1.0, 2.5), 'torso': (1.0, 1.7),
           'head': (1.0, 0.95), 'camera': (1.0, 0.2)}


def _draw(pairs: list[Pair], figure: Figure) -> None:
    tree, theirs, ours = figure.subplots(1, 3, width_ratios=(1.0, 1.25, 1.25))
    _draw_tree(tree)
    _draw_answers(theirs, 'tf2', {
        pair[:2]: (pair.tf2, pair.tf2 is not None and _note(pair) != '') for pair in pairs})
    _draw_answers(ours, 'this tree', {pair[:2]: (pair.here, False) for pair in pairs})
    theirs.set_yticks(range(len(FRAMES)), FRAMES)
    theirs.set_ylabel('target frame')
    ours.set_yticks([])
    figure.supxlabel('white: by /ekf and the static edges;  light grey, italic: by the second '
                     f'node;  dark: fails, more than {_TF2_MAX_DEPTH} deep', fontsize=8.5)


def _draw_answers(axes: Axes, who: str,
                  answers: Mapping[tuple[str, str], tuple[float | None, bool]]) -> None:
    """Draw a square for each pair of frames: x, or that the lookup fails."""
    from matplotlib.patches import Rectangle
    for (target, source), (x, by_second) in answers.items():
        column, row = FRAMES.index(source), FRAMES.index(target)
        text, face, ink = 'fails', '#565656', 'white'
        if x is not None:
            text, face, ink = f'{x:.1f}', '#dcdcdc' if by_second else 'white', 'black'
        axes.add_patch(Rectangle(
            (column - 0.5, row - 0.5), 1.0, 1.0, facecolor=face, edgecolor='black'))
        axes.annotate(text, (column, row), ha='center', va='center', color=ink,
                      style='italic' if by_second else 'normal')
    failed = sum(x is None for x, _ in answers.values())
    axes.set_xticks(range(len(FRAMES)), FRAMES, rotation=45, ha='right', rotation_mode='anchor')
    axes.set(xlim=(-0.5, 4.5), ylim=(4.5, -0.5), xlabel='source frame', aspect='equal',
             title=f'{who}: x [m]; {failed} of {len(answers)} fail')
    axes.grid(visible=False)


def _draw_tree(axes: Axes) -> None:
    """Draw the frames, arrows from parent to child."""
    arrow = {'arrowstyle': '-|>', 'linewidth': 1.6}
    loop = {**arrow, 'connectionstyle': 'arc3,rad=0.4', 'shrinkA': 14.0, 'shrinkB': 14.0}
    axes.annotate('', _PLACES['base_link'], _PLACES['odom'],
                  arrowprops={**loop, 'color': 'black'})
    axes.annotate('', _PLACES['odom'], _PLACES['base_link'],
                  arrowprops={**loop, 'color': STYLES[2]['color'], 'linestyle': '--'})
    axes.annotate(EKF, (0.52, 3.15), ha='right', va='center')
    axes.annotate(f'{WHEELS}\ncloses the loop', (1.5, 3.15), va='center',
                  color=STYLES[2]['color'])
    for child, (parent, _) in BELOW.items():
        sideways = 22.0 if parent == 'odom' else 9.0
        axes.annotate('', _PLACES[child], _PLACES[parent], arrowprops={
            **arrow, 'shrinkA': sideways, 'shrinkB': sideways, 'color': GREY})
    for frame, place in _PLACES.items():
        axes.annotate(frame, place, ha='center', va='center', bbox={
            'boxstyle': 'round', 'facecolor': 'white', 'edgecolor': 'black'})
    axes.set(xlim=(-0.1, 3.0), ylim=(-0.1, 4.2), title='Parent → child; grey: static')
    axes.set_axis_off()
