# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A project with this one's settings of pytest and its helpers, for tests of the tests."""

from pathlib import Path
import shutil

TESTS = Path(__file__).parent


def small_project(folder: Path) -> Path:
    """Make a project without tests in a folder, and return the folder."""
    (folder / 'test').mkdir()
    shutil.copy(TESTS.parent / 'pyproject.toml', folder)
    for path in TESTS.glob('*.py'):
        if not path.name.startswith('test_'):
            shutil.copy(path, folder / 'test')
    return folder
