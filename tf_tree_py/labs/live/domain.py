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

"""A DDS domain for a lab that no other lab on this machine is in."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
import os
import socket

# People use smaller ones; the ports of these lie above those that Linux gives to programs.
FIRST_DOMAIN, DOMAINS = 216, 16


@contextmanager
def own_domain() -> Iterator[int]:
    """Keep other labs out of a domain for a while; if all are taken, share one."""
    start = os.getpid()
    ids = [FIRST_DOMAIN + (start + number) % DOMAINS for number in range(DOMAINS)]
    with closing(socket.socket(socket.AF_UNIX)) as claim:
        yield next((domain_id for domain_id in ids if _is_taken_by(claim, domain_id)), ids[0])


def _is_taken_by(claim: socket.socket, domain_id: int) -> bool:
    """Return whether a socket gets a domain's name, which one at a time can have."""
    try:
        # A name that is no file: it is gone with the process, however that ends.
        claim.bind(f'\0tf_tree_py lab, domain {domain_id}')
    except OSError:
        return False
    return True
