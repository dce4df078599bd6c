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

"""One bag is one task, and what came of it is kept as soon as it is there."""

from collections.abc import Iterator, Sequence
from typing import Any
from uuid import uuid4

from .bags import BagPath
from .jobs import done, failed, Job, LOST, Result
from ..endings import needs


def results(client: Any, job: Job, bags: Sequence[BagPath]) -> Iterator[tuple[BagPath, Result]]:
    """
    Yield what came of each bag, in the order in which they are done.

    :param client: of dask.
    """
    run = uuid4().hex
    waiting = {client.submit(done, job, bag.path, key=f'bag-{run}-{number}', pure=False): bag
               for number, bag in enumerate(bags)}
    for future in needs('distributed', 'distributed', 'archive').as_completed(list(waiting)):
        bag = waiting.pop(future)
        yield bag, _result(future)
        future.release()


def _result(future: Any) -> Result:
    killed = needs('distributed', 'distributed', 'archive').KilledWorker
    try:
        result: Result = future.result()
        return result
    except killed:
        return failed(LOST, 'every worker that read it was killed; was there enough memory?')
    except Exception as error:  # noqa: B902 - of whatever kind, it costs this row
        return failed(LOST, f'{type(error).__name__}: {error}')
