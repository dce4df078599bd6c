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

"""A DDS domain for each process that runs tests, which nobody else on this machine is in."""

from functools import cache
import os
from pathlib import Path
import socket

# DDS (RTPS 2.5, 9.6.2.3): a domain's ports begin here, and so many further on the next one's.
_FIRST_PORT, _PORTS_A_DOMAIN = 7400, 250
# Those of a lab's sessions, which tests start too, lie above.
_DOMAINS = range(1, 216)
_EPHEMERAL = Path('/proc/sys/net/ipv4/ip_local_port_range')
_LINUX_DEFAULT = 32768, 60999

# What keeps other test processes off the domains of this one.
_claims: list[socket.socket] = []


def isolate() -> None:
    """Keep this process, and those that it starts, to this machine and a domain of their own."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['ROS_DOMAIN_ID'] = str(_own())


def claim() -> int:
    """Return one more domain that is ours until this process ends."""
    # Where the system gives away every port, one domain is as good as another.
    ids = [domain_id for domain_id in _DOMAINS if is_safe(domain_id)] or list(_DOMAINS)
    start = os.getpid() % len(ids)
    for domain_id in ids[start:] + ids[:start]:
        taken = socket.socket(socket.AF_UNIX)
        try:
            # An abstract name: it is gone with the process, however that ends.
            taken.bind(f'\0tf_tree_py tests, domain {domain_id}')
        except OSError:
            taken.close()
        else:
            _claims.append(taken)
            return domain_id
    raise RuntimeError(f'all {len(ids)} domains are taken by other test processes')


def ports(domain_id: int) -> range:
    """Return the ports that participants of a domain listen on."""
    first = _FIRST_PORT + _PORTS_A_DOMAIN * domain_id
    return range(first, first + _PORTS_A_DOMAIN)


def is_safe(domain_id: int) -> bool:
    """
    Return whether the system gives none of a domain's ports to other programs.

    It does give away what lies in its ephemeral range; a participant whose port is taken
    goes to the next one, where others do not look for it.
    """
    lowest, highest = _ephemeral()
    used = ports(domain_id)
    return used[-1] < lowest or used[0] > highest


@cache
def _own() -> int:
    return claim()


def _ephemeral() -> tuple[int, int]:
    try:
        lowest, highest = map(int, _EPHEMERAL.read_text().split())
    except OSError:
        return _LINUX_DEFAULT
    return lowest, highest
