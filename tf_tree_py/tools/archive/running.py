# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Runs one task for each bag, and yields each result as soon as it is available.

The processes that read bags are local workers, or an existing cluster.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import logging
from typing import Any
from uuid import uuid4

from tf_tree_py.command.endings import Cannot, needs

from . import ignore_ctrl_c
from .jobs import BagPath, done, failed, Job, LOST, Result

# A bag whose workers were killed this often is given up.
_TRIES = 2
# Only this machine may reach the workers and their dashboards.
_HERE = '127.0.0.1'


@contextmanager
def client_of(scheduler: str | None, workers: int) -> Iterator[Any]:
    """
    Return a client of dask.

    :param scheduler: of an existing cluster, such as ``tcp://host:8786``; None: local workers,
        which end with the client.
    :param workers: the number of local workers.
    :raises Cannot: dask is not installed, or no scheduler answers.
    """
    distributed = needs('distributed', 'distributed')
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
           'preload': [ignore_ctrl_c.__name__], 'silence_logs': logging.CRITICAL}
    with (_settings(), distributed.LocalCluster(**own) as cluster,
          distributed.Client(cluster) as client):
        yield client


def _settings() -> Any:
    return needs('dask', 'dask').config.set({
        'distributed.scheduler.allowed-failures': _TRIES - 1,
        # A worker holds one bag at a time, so the loss of a worker affects only one bag.
        'distributed.scheduler.worker-saturation': 1.0,
        'distributed.worker.profile.enabled': False,
        # By default dask gives up a worker that was killed and is not back after 15 s. On a busy
        # machine all of them would go, and the rest of the bags would wait forever.
        'distributed.deploy.lost-worker-timeout': '1 day',
    })


# --- running

def results(client: Any, job: Job, bags: Sequence[BagPath]) -> Iterator[tuple[BagPath, Result]]:
    """
    Yield the result for each bag, in the order in which they finish.

    :param client: of dask.
    """
    run = uuid4().hex
    waiting = {client.submit(done, job, bag.path, key=f'bag-{run}-{number}', pure=False): bag
               for number, bag in enumerate(bags)}
    for future in needs('distributed', 'distributed').as_completed(list(waiting)):
        bag = waiting.pop(future)
        yield bag, _result(future)
        future.release()


def _result(future: Any) -> Result:
    killed = needs('distributed', 'distributed').KilledWorker
    try:
        result: Result = future.result()
        return result
    except killed:
        return failed(LOST, 'every worker that read it was killed, perhaps for lack of memory')
    except Exception as error:  # noqa: B902 - any error affects only this row
        return failed(LOST, f'{type(error).__name__}: {error}')
