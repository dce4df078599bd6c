# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The fixtures of the ROS layer's tests, and more."""

import sys
import textwrap

import pytest
from ros.conftest import (  # noqa: F401
    context,
    executor,
    listen,
    make_node,
    no_thread_is_left,
    node,
    pool,
    sharing,
    sim_clock,
    spin,
    talker,
    woken_events_executor,
    writer,
)
from tf_tree_py import dropin


@pytest.fixture(scope='module')
def installed():
    """Install our packages, even over tf2's own; restore them afterwards."""
    path = sys.path[:]
    others = {name: sys.modules.pop(name) for name in list(sys.modules) if is_tf2(name)}
    dropin.install(force=True)
    yield
    for name in filter(is_tf2, list(sys.modules)):
        del sys.modules[name]
    sys.modules.update(others)
    sys.path[:] = path


def is_tf2(name):
    return name.split('.')[0] in dropin.NAMES


@pytest.fixture
def program(tmp_path):
    """Return a function that writes a program, and returns its path."""
    def write(code, name='program.py'):
        file = tmp_path / name
        file.write_text(textwrap.dedent(code))
        return file

    return write


@pytest.fixture
def real(tmp_path):
    """Return a folder with a tf2_ros that is not ours."""
    folder = tmp_path / 'installed'
    (folder / 'tf2_ros').mkdir(parents=True)
    (folder / 'tf2_ros' / '__init__.py').write_text(textwrap.dedent("""
        class Registration:
            known = {}
            def add(self, key, callback):
                self.known[key] = callback
            add_to_msg = add_from_msg = lambda self, key, callback: None
        TransformRegistration = ConvertRegistration = Registration
    """))
    return folder
