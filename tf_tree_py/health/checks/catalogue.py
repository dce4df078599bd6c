# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every check; the failure modes of the textbook come first."""

from . import clocks, graph, poses, rates, samples, structure
from .finding import Check

_FOUND = [check for module in (structure, samples, poses, clocks, rates, graph)
          for check in vars(module).values() if isinstance(check, Check)]

CODES = {check.name: check for check in sorted(_FOUND, key=lambda check: not check.textbook)}
CHECKS = tuple(CODES.values())
