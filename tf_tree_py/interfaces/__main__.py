"""The command line: ``python -m tf_tree_py.interfaces``."""

import argparse
from pathlib import Path
import sys

from .building import build, CannotBuild, find
from .hashes import differing


def main() -> int:
    """Build tf2_msgs if there is none, and hold what there is against Jazzy's type hashes."""
    argparse.ArgumentParser(
        prog='python -m tf_tree_py.interfaces',
        description='Build tf2_msgs into the environment that runs this, beside the wheels of '
                    "ROS 2 Jazzy, which lack it (pip install 'tf_tree_py[jazzy]'; and a C++ "
                    'compiler). Where there is one, only check that its types are those of '
                    'Jazzy.').parse_args()
    try:
        return _build_or_check()
    except CannotBuild as error:
        print(f'tf2_msgs: {error}', file=sys.stderr)
    except KeyboardInterrupt:
        return 130
    return 1


def _build_or_check() -> int:
    prefix = find()
    if prefix is None:
        prefix = Path(sys.prefix)
        print(f'building tf2_msgs into {prefix}, some twenty seconds', flush=True)
        build(prefix)
    elif wrong := differing(prefix):
        print(f'tf2_msgs: that of {prefix} has other types than Jazzy: {", ".join(wrong)}',
              file=sys.stderr)
        return 1
    print(f'tf2_msgs is in {prefix}, and all its types are those of ROS 2 Jazzy')
    return 0


if __name__ == '__main__':
    sys.exit(main())
