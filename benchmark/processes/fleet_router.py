# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

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
