# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Gives an installed package of the same name precedence, also with ``--force``."""

from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
import sys

from . import PACKAGES


def is_installed(name: str) -> bool:
    """
    Import an installed package in place of this package's one.

    This package's one calls it during its import, which then returns the module in
    ``sys.modules``.

    :return: whether one is installed.
    """
    others = [folder for folder in sys.path if Path(folder).absolute() != Path(PACKAGES)]
    spec = PathFinder.find_spec(name, others)
    if spec is None or spec.loader is None:
        return False
    sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return True
