# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command line: ``python -m tf_tree_py.interfaces``."""

import argparse
from pathlib import Path
import sys

from .building import build, CannotBuild, demand_what_it_takes, differing, find


def main() -> int:
    """Build tf2_msgs if it is missing, and compare its type hashes with Jazzy's."""
    argparse.ArgumentParser(
        prog='python -m tf_tree_py.interfaces',
        description='Builds tf2_msgs into the environment that runs this, because the wheels of '
                    'ROS 2 Jazzy do not contain it. It requires these wheels (pip install '
                    "'.[jazzy]' in a checkout of this package) and a C++ compiler. If tf2_msgs "
                    'is installed, this only checks that its types are those of Jazzy.'
    ).parse_args()
    try:
        _build_or_check()
    except CannotBuild as error:
        _say(str(error))
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _build_or_check() -> None:
    prefix = find()
    if prefix is None:
        prefix = Path(sys.prefix)
        demand_what_it_takes(prefix)
        _say(f'building it into {prefix}, which takes about twenty seconds')
        build(prefix)
    if wrong := differing(prefix):
        raise CannotBuild(f'the one in {prefix} differs from that of ROS 2 Jazzy in these types: '
                          f'{", ".join(wrong)}')
    _say(f'it is in {prefix}, and all its types are those of ROS 2 Jazzy')


def _say(text: str) -> None:
    print(f'tf2_msgs: {text}', file=sys.stderr, flush=True)


if __name__ == '__main__':
    sys.exit(main())
