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

"""A bar on the terminal while bags are read; where there is no terminal, nothing."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import multiprocessing
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """
    Show how much of a bag, or how many bags, have been read.

    :param total: how many messages, or bags, there are.
    :return: what to call with the number of those that were just read.
    """
    # A worker shares the terminal of the process that started it, and leaves it to that one.
    alone = multiprocessing.parent_process() is None
    bar = _bar() if alone and sys.stderr.isatty() else None
    if bar is None:
        yield lambda _: None
        return
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda read: bar.advance(task, read)


def _bar() -> 'Progress | None':
    try:
        from rich.console import Console
        from rich.progress import Progress
    except ImportError:  # no reason not to read
        return None
    return Progress(console=Console(stderr=True), transient=True)
