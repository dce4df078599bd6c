# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A DDS domain for each test process, which no other process on this machine uses."""

from functools import cache
import os
from pathlib import Path
import socket

# DDS (RTPS 2.5, 9.6.2.3): the first port of domain 0, and the number of ports per domain.
_FIRST_PORT, _PORTS_A_DOMAIN = 7400, 250
# The domains of a lab's sessions, which tests also start, are above these.
_DOMAINS = range(1, 216)
PROFILES = Path(__file__).parents[1] / 'config' / 'fastdds_without_shared_memory.xml'
_EPHEMERAL = Path('/proc/sys/net/ipv4/ip_local_port_range')
_LINUX_DEFAULT = 32768, 60999

# The variable that names the profiles: Fast DDS 3, in Kilted, warns about that of version 2.
JAZZY_PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
PROFILES_VARIABLE = 'FASTDDS_DEFAULT_PROFILES_FILE' if any(
    Path(prefix, 'share', 'fastdds').is_dir()
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
) else JAZZY_PROFILES

# Sockets that reserve the domains of this process, against other test processes.
_claims: list[socket.socket] = []


def isolate() -> None:
    """
    Restrict this process and its children to this machine and to a DDS domain of their own.

    Domains do not separate the shared memory of Fast DDS: programs that start at the same time
    print errors about its ports, among their output, and one that is killed may crash those that
    listen to it (docs/ending.md). So they use the loopback interface only.
    """
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['ROS_DOMAIN_ID'] = str(_own())
    os.environ[PROFILES_VARIABLE] = str(PROFILES)


def with_shared_memory() -> dict[str, str]:
    """Return the environment variables of a process that uses shared memory, as by default."""
    return {name: value for name, value in os.environ.items() if name != PROFILES_VARIABLE}


def claim() -> int:
    """
    Return one more domain that is reserved until this process ends.

    It is empty: no program of a developer is there, nor one that a killed test process has left.
    """
    # Where the system assigns every port to programs, one domain is as good as another.
    ids = [domain_id for domain_id in _DOMAINS if is_safe(domain_id)] or list(_DOMAINS)
    start = os.getpid() % len(ids)
    for domain_id in ids[start:] + ids[:start]:
        taken = socket.socket(socket.AF_UNIX)
        try:
            # An abstract name: it disappears with the process, however the process ends.
            taken.bind(f'\0tf_tree_py tests, domain {domain_id}')
        except OSError:
            taken.close()
            continue
        if is_empty(domain_id):
            _claims.append(taken)
            return domain_id
        taken.close()
    raise RuntimeError(f'all {len(ids)} domains are taken by other processes')


def ports(domain_id: int) -> range:
    """Return the ports on which the participants of a domain listen."""
    first = _FIRST_PORT + _PORTS_A_DOMAIN * domain_id
    return range(first, first + _PORTS_A_DOMAIN)


def is_empty(domain_id: int) -> bool:
    """Return whether no participant listens in a domain."""
    for port in ports(domain_id):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', port))
            except OSError:
                return False
    return True


def is_safe(domain_id: int) -> bool:
    """
    Return whether the system assigns none of a domain's ports to other programs.

    It assigns ports of its ephemeral range. A participant whose port is taken uses the next
    one, where other participants do not look for it.
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
