# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The command line: ``python -m tf_tree_py.interfaces``."""

import argparse
from pathlib import Path
import sys

from .building import build, CannotBuild, demand_what_it_takes, find
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
        _say(f'building it into {prefix}, some twenty seconds')
        build(prefix)
    if wrong := differing(prefix):
        raise CannotBuild(f'that of {prefix} has other types than Jazzy: {", ".join(wrong)}')
    _say(f'it is in {prefix}, and all its types are those of ROS 2 Jazzy')


def _say(text: str) -> None:
    print(f'tf2_msgs: {text}', file=sys.stderr, flush=True)


if __name__ == '__main__':
    sys.exit(main())
