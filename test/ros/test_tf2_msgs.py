# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The installed tf2_msgs is the official one, or equivalent on the wire."""

import os
from pathlib import Path
import shutil
import sys

from ament_index_python.packages import get_package_prefix
from programs import completed
from tf_tree_py.interfaces.type_hashes import differing

PREFIX = get_package_prefix('tf2_msgs')


def interfaces(**variables):
    """Run the command that builds tf2_msgs; return its status and its output."""
    done = completed(sys.executable, '-m', 'tf_tree_py.interfaces',
                     env={**os.environ, **variables})
    return done.returncode, done.stdout + done.stderr


def test_installed_tf2_msgs_is_that_of_jazzy_and_only_checked():
    assert differing(Path(PREFIX)) == []
    assert interfaces() == (
        0, f'tf2_msgs: it is in {PREFIX}, and all its types are those of ROS 2 Jazzy\n')


def test_other_tf2_msgs_is_told_of(tmp_path):
    share = shutil.copytree(Path(PREFIX, 'share/tf2_msgs'),
                            tmp_path / 'share' / 'tf2_msgs')
    error = share / 'msg' / 'TF2Error.json'
    error.write_text(error.read_text().replace('RIHS01_db', 'RIHS01_bd'))
    (share / 'srv' / 'FrameGraph.json').unlink()
    assert differing(tmp_path) == ['tf2_msgs/msg/TF2Error', 'tf2_msgs/srv/FrameGraph']
    status, said = interfaces(AMENT_PREFIX_PATH=str(tmp_path))
    assert status == 1
    assert 'in these types: tf2_msgs/msg/TF2Error, tf2_msgs/srv/FrameGraph' in said
