# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command line: ``python -m tf_tree_py.interfaces``."""

import argparse
from pathlib import Path
import sys

from .building import build, CannotBuild, find, sources
from .kept import Kept, user_cache
from .type_hashes import differing


def main() -> int:
    """Build tf2_msgs if it is missing, and compare its type hashes with Jazzy's."""
    parser = argparse.ArgumentParser(
        prog='python -m tf_tree_py.interfaces',
        description='Builds tf2_msgs into the environment that runs this, because the wheels of '
                    'ROS 2 do not contain it. It requires these wheels (pip install '
                    "'.[jazzy]' in a checkout of this package) and a C++ compiler. If tf2_msgs "
                    'is installed, or a ROS 2 that has it is sourced, this only checks that its '
                    'types are those of Jazzy. A build is kept in '
                    f'{user_cache()}, for other environments with the same wheels.')
    parser.add_argument('--no-cache', action='store_true',
                        help='build it anew, and do not keep it')
    arguments = parser.parse_args()
    try:
        _build_or_check(not arguments.no_cache)
    except CannotBuild as error:
        _say(str(error))
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _build_or_check(keeping: bool) -> None:
    prefix = find()
    if prefix is None:
        prefix = Path(sys.prefix)
        cache = user_cache() if keeping else None
        build(prefix, Kept(cache, sources()) if cache else None, _say)
    if wrong := differing(prefix):
        raise CannotBuild(f'the one in {prefix} differs from that of ROS 2 Jazzy in these types: '
                          f'{", ".join(wrong)}')
    _say(f'it is in {prefix}, and all its types are those of ROS 2 Jazzy')


def _say(text: str) -> None:
    print(f'tf2_msgs: {text}', file=sys.stderr, flush=True)


if __name__ == '__main__':
    sys.exit(main())
