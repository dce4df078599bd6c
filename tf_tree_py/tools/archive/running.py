# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs one task for each bag, and yields each result as soon as it is available."""

from collections.abc import Iterator, Sequence
from typing import Any
from uuid import uuid4

from tf_tree_py.command.endings import needs

from .bags import BagPath
from .jobs import done, failed, Job, LOST, Result


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
