# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lets code that imports tf2_ros run on this package, unchanged.

The folder ``packages`` holds packages with tf2's names, which only import from here. It is added
to Python's path; nothing else is changed:

    python -m tf_tree_py.dropin your_node.py arguments
    python -m tf_tree_py.dropin -m pytest

In a program, before the first import of tf2:

    import tf_tree_py.dropin
    tf_tree_py.dropin.install()
"""

import importlib
from pathlib import Path
import sys

NAMES = ('tf2_ros', 'tf2_py', 'tf2_geometry_msgs', 'tf2_sensor_msgs')
PACKAGES = str(Path(__file__).parent / 'packages')
"""The folder of the packages, for ``PYTHONPATH``."""


def install(force: bool = False) -> None:
    """
    Make tf2_ros, tf2_py, tf2_geometry_msgs and tf2_sensor_msgs importable.

    An installed one takes precedence, unless forced. ``tf_transformations``, which many programs
    also import, becomes importable, too; an installed one always takes precedence. Another call is
    harmless.

    :param force: prefer this package, even if tf2 is installed.
    :raises RuntimeError: forced, and one of them was imported before.
    """
    if force:
        for name in NAMES:
            _check_is_not_another(name)
    if PACKAGES in sys.path:
        sys.path.remove(PACKAGES)
    sys.path.insert(0 if force else len(sys.path), PACKAGES)
    importlib.invalidate_caches()


def _check_is_not_another(name: str) -> None:
    module = sys.modules.get(name)
    place = getattr(module, '__file__', None) or 'somewhere'
    if module is not None and not place.startswith(PACKAGES):
        raise RuntimeError(
            f'{name} was imported from {place} already: call '
            'tf_tree_py.dropin.install(force=True) before the first import of it')
