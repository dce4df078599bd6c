# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The options of both commands: the number of runs, the seed, and the form of the report."""

import argparse

NAME = 'arm'

_DESCRIPTION = """\
A simulated arm with a camera on its wrist picks a red block and places it in a tray. What the
camera sees, the transform tree takes to the world: docs/pick_and_place.md goes through it."""


def parser() -> argparse.ArgumentParser:
    """Return a parser, to which each command adds its own options."""
    options = argparse.ArgumentParser(prog=NAME, description=_DESCRIPTION, allow_abbrev=False)
    options.add_argument('--runs', type=_positive, default=20, metavar='N',
                         help='how many blocks, one after the other; default: 20')
    options.add_argument('--seed', type=_natural, default=0, metavar='N',
                         help='which random blocks; default: 0')
    options.add_argument('--json', action='store_true', help='print JSON instead')
    options.add_argument('--ros', action='store_true',
                         help='over DDS: the arm, perception and the tree in processes of their '
                              'own, in real time')
    return options


def _natural(text: str) -> int:
    if (number := int(text)) < 0:
        raise ValueError
    return number


def _positive(text: str) -> int:
    if (number := int(text)) < 1:
        raise ValueError
    return number
