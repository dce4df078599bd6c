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

"""The processes that read bags: some of our own on this machine, or an existing cluster."""

from collections.abc import Iterator
from contextlib import contextmanager
import logging
from typing import Any

from . import shielding
from ..endings import Cannot, needs

# A bag whose workers were killed this often is given up.
_TRIES = 2
# Nobody but this machine is to reach them, nor their dashboards.
_HERE = '127.0.0.1'


@contextmanager
def client_of(scheduler: str | None, workers: int) -> Iterator[Any]:
    """
    Return a client of dask.

    :param scheduler: of an existing cluster, such as ``tcp://host:8786``; None: so many
        workers of our own, which end with the client.
    :raises Cannot: dask is not installed, or nobody answers there.
    """
    distributed = needs('distributed', 'distributed', 'archive')
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler)
        except (OSError, ValueError) as error:
            raise Cannot(f'no scheduler answers at {scheduler}: {error}') from error
        with client:
            yield client
        return
    own = {'n_workers': workers, 'threads_per_worker': 1, 'host': _HERE,
           'dashboard_address': f'{_HERE}:0', 'worker_dashboard_address': f'{_HERE}:0',
           'preload': [shielding.__name__], 'silence_logs': logging.CRITICAL}
    with (_settings(), distributed.LocalCluster(**own) as cluster,
          distributed.Client(cluster) as client):
        yield client


def _settings() -> Any:
    return needs('dask', 'dask', 'archive').config.set({
        'distributed.scheduler.allowed-failures': _TRIES - 1,
        # A worker holds one bag at a time, so one that is killed tells nothing of the others.
        'distributed.scheduler.worker-saturation': 1.0,
        'distributed.worker.profile.enabled': False,
    })
