# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page about notebooks shows a speed and the walls of a room as they are, without ROS."""

import sys

import numpy as np
from pages import BLOCKS
import pytest

[BLOCK] = [block for block in BLOCKS
           if block.page == 'docs/notebook.md' and block.language == 'python']
# The room in map, metres: half its width, and its middle.
HALF, MIDDLE = 5.0, (0.0, -1.0)


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    """Return the variables of the page after it has run."""
    for needed in ('rosbags', 'matplotlib', 'pandas'):
        pytest.importorskip(needed)
    import matplotlib.pyplot as plt
    variables = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp('notebook'))
        for ros in ('rclpy', 'geometry_msgs', 'sensor_msgs', 'std_msgs', 'tf2_msgs'):
            patch.setitem(sys.modules, ros, None)
        try:
            exec(compile(BLOCK.code, str(BLOCK), 'exec'), variables)
        finally:
            plt.close('all')
        for picture in ('speed.png', 'scan.png'):
            with open(picture, 'rb') as file:
                assert file.read(4) == b'\x89PNG'
    return variables


def test_table_has_the_speed_for_all_time_with_data(shown):
    table, stamps = shown['table'], shown['stamps']
    assert table.index.name == 'time' and table.index.astype('int64').tolist() == stamps.tolist()
    # map -> odom begins a second later than odom -> base_link, because it is post-dated.
    assert len(table) == 200 and stamps[0] == 1_700_000_001 * 10**9
    assert table['speed'].to_numpy() == pytest.approx(np.ones(200), rel=1e-3)


def test_points_are_on_the_walls_after_deskewing_only(shown):
    def off(points):
        """Return how far points are from the walls, metres."""
        return np.abs(np.abs(points[:, :2] - MIDDLE).max(axis=1) - HALF)

    assert len(shown['deskewed']) == 720
    assert off(shown['deskewed']).max() < 0.001
    assert off(shown['skewed']).max() > 0.3
