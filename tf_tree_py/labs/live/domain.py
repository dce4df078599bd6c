# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A DDS domain for a lab, not shared with other labs on this machine."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
import os
import socket

# Users choose smaller numbers. The ports of these are above Linux's ephemeral ports.
FIRST_DOMAIN, DOMAINS = 216, 16


@contextmanager
def own_domain() -> Iterator[int]:
    """Reserve a domain within the context; if all are taken, share one."""
    start = os.getpid()
    ids = [FIRST_DOMAIN + (start + number) % DOMAINS for number in range(DOMAINS)]
    with closing(socket.socket(socket.AF_UNIX)) as claim:
        yield next((domain_id for domain_id in ids if _is_taken_by(claim, domain_id)), ids[0])


def _is_taken_by(claim: socket.socket, domain_id: int) -> bool:
    """Return whether a socket obtains a domain's name, which only one can have at a time."""
    try:
        # An abstract name, not a file: it disappears when the process ends, in any way.
        claim.bind(f'\0tf_tree_py lab, domain {domain_id}')
    except OSError:
        return False
    return True
