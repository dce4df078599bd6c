"""
Draw docs/images/five_frames.svg: the five frames of the demo, seen from above.

python docs/figures/five_frames.py (needs matplotlib; no ROS)
"""

from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from tf_tree_py.core import BufferCore, Pose
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion

matplotlib.rcParams.update({'svg.hashsalt': 'tf_tree_py', 'font.size': 11})

NOW = from_seconds(26.5)
IMAGES = Path(__file__).parents[1] / 'images'
# Where each name stands, in points from its frame.
LABELS = {'world': (-8, -22), 'odom': (26, 16), 'base_link': (64, -18), 'camera': (-52, 44),
          'gripper': (-10, -54)}
PAPER = {'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.0}


def recorded(motion: FiveFrameMotion) -> BufferCore:
    """Return a buffer that holds the last eight seconds of the robot."""
    buffer = BufferCore()
    for stamp in range(NOW - from_seconds(8.0), NOW + 1, from_seconds(0.02)):
        buffer.insert('world', 'odom', stamp, motion.world_T_odom(stamp))
        buffer.insert('odom', 'base_link', stamp, motion.odom_T_base_link(stamp))
        buffer.insert('base_link', 'gripper', stamp, motion.base_link_T_gripper(stamp))
    buffer.insert('base_link', 'camera', NOW, motion.base_link_T_camera, static=True)
    return buffer


def draw_axes(axes: Axes, name: str, world_T_frame: Pose) -> None:
    """Draw a frame's x (solid) and y (dashed) axis, and its name."""
    origin = np.array(world_T_frame.translation)
    for unit, style in (((0.25, 0.0, 0.0), '-'), ((0.0, 0.25, 0.0), (0, (2, 1)))):
        tip = world_T_frame @ unit
        axes.plot(*zip(origin[:2], tip[:2], strict=True), linestyle=style, color='black', lw=1.8)
    axes.plot(*origin[:2], 'o', color='black', markersize=4)
    axes.annotate(name, origin[:2], LABELS[name], textcoords='offset points', fontsize=13,
                  ha='center', va='center', bbox=PAPER,
                  arrowprops={'arrowstyle': '-', 'color': '0.4', 'lw': 0.8, 'shrinkB': 4})


def main() -> None:
    """Write the picture, as SVG and as PNG."""
    buffer = recorded(FiveFrameMotion())
    stamps = np.arange(NOW - from_seconds(7.9), NOW + 1, from_seconds(0.02))
    figure = Figure(figsize=(7.2, 5.2))
    axes = figure.subplots()
    for frame, style, width in (('base_link', '-', 2.2), ('gripper', ':', 1.6)):
        track = buffer.lookup_many('world', frame, stamps)
        axes.plot(track[:, 0], track[:, 1], style, color='0.6', lw=width,
                  label=f'{frame}, the last 8 s')
    poses = buffer.lookup_tree('world', NOW)
    for child, parent in (('odom', 'world'), ('base_link', 'odom')):
        axes.annotate('', xy=poses[parent].translation[:2], xytext=poses[child].translation[:2],
                      arrowprops={'arrowstyle': '->', 'color': '0.45', 'lw': 0.8})
    for name, pose in poses.items():
        draw_axes(axes, name, pose)
    axes.set_aspect('equal')
    axes.set_xlim(-1.8, 3.1)
    axes.set_ylim(-0.8, 2.5)
    axes.set_xlabel('x in world [m]')
    axes.set_ylabel('y in world [m]')
    axes.set_title('The five frames from above: x axes solid, y axes dashed')
    axes.legend(loc='lower left', fontsize=11)
    figure.tight_layout()
    for ending in ('svg', 'png'):
        figure.savefig(IMAGES / f'five_frames.{ending}', dpi=120,
                       metadata={'Date': None} if ending == 'svg' else None)


if __name__ == '__main__':
    main()
