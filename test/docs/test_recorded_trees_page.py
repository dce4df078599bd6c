# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page about recorded trees plots the recording of an ordinary Nav2 robot."""

import numpy as np
from pages import BLOCKS
import pytest
from tf_tree_py import BufferCore, Pose, UNLIMITED

SECOND = 10**9
BEGIN = 1_700_000_000 * SECOND
# The default of AMCL's transform_tolerance.
POST_DATED = SECOND
[PLOT] = [block for block in BLOCKS
          if block.page == 'docs/recorded_trees.md' and 'plt.savefig' in block.code]


@pytest.fixture
def expected(tmp_path, monkeypatch):
    """Write a bag with a post-dated map -> odom; return what was written, as a buffer."""
    bags = pytest.importorskip('bags', reason='needs rosbags')
    messages = [bags.Message(BEGIN, '/tf_static', [
        ('base', 'camera', 0, (0.2, 0.0, 0.8, 0.0, 0.0, 0.0, 1.0))], bags.LATCHED)]
    for tick in range(500):
        now, turned = BEGIN + tick * SECOND // 50, 0.002 * tick
        messages.append(bags.Message(now, '/tf', [
            ('odom', 'base', now, tuple(Pose.from_xyz_rpy(x=0.02 * tick, yaw=turned)))]))
        if tick % 5 == 0:
            messages.append(bags.Message(now, '/tf', [
                ('map', 'odom', now + POST_DATED, tuple(Pose(x=3.0, y=0.001 * tick)))]))
    bags.file_of(bags.write_ros2(tmp_path / 'run', messages)).rename(tmp_path / 'run.mcap')
    monkeypatch.chdir(tmp_path)
    written = BufferCore(UNLIMITED)
    for message in messages:
        for parent, child, stamp, pose in message.transforms:
            written.insert(parent, child, stamp, pose, static=message.topic == '/tf_static')
    return written


def test_plot_covers_all_time_for_which_a_post_dated_tree_has_data(expected, tmp_path):
    plt = pytest.importorskip('matplotlib.pyplot')
    variables = {'np': np}
    try:
        exec(compile(PLOT.code, str(PLOT), 'exec'), variables)
        [line] = plt.gca().lines
        drawn, stamps = line.get_xydata(), variables['stamps']
    finally:
        plt.close('all')
    assert (tmp_path / 'trajectory.png').read_bytes().startswith(b'\x89PNG')
    # From the first stamp of map -> odom to the last of odom -> base.
    assert stamps[0] == BEGIN + POST_DATED
    assert 0 <= BEGIN + 499 * SECOND // 50 - stamps[-1] < SECOND // 20
    assert set(np.diff(stamps).tolist()) == {SECOND // 20}
    places = [expected.lookup('map', 'camera', stamp)[:2] for stamp in stamps.tolist()]
    np.testing.assert_allclose(drawn, places, rtol=1e-12)
