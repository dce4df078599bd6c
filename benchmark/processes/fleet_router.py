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

"""A router of Zenoh on this machine: ``python -m benchmark.processes.fleet_router ADDRESS``."""

import sys

from tf_tree_py.fleet import open_session
import zenoh

from ..worker import serve


def main(address: str) -> None:
    """Route until the input ends."""
    config = zenoh.Config.from_json5(f"""{{
        mode: 'router', listen: {{endpoints: ['{address}']}},
        scouting: {{multicast: {{enabled: false}}}}}}""")
    with open_session(config):
        serve({'is_up': lambda: True})


if __name__ == '__main__':
    main(sys.argv[1])
