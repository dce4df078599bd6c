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

"""Tests that go through many inputs of one kind: one test, which names the input it fails with."""

from collections.abc import Callable, Iterable
import functools
import inspect
import itertools
from typing import Any


def for_each(**inputs: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """
    Run a test with every input; with every combination, if several arguments have inputs.

    All of them share the test's fixtures, which therefore must not remember anything. The
    other decorators of the test stand above this one, except for those of hypothesis.

    :param inputs: what each argument takes.
    """
    names = list(inputs)
    combinations = list(itertools.product(*inputs.values()))
    assert combinations, 'a test without inputs holds nothing'

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        # Without what hypothesis has noted down: it ends below here.
        @functools.wraps(test, updated=())
        def run(**fixtures: Any) -> None:
            for values in combinations:
                chosen = dict(zip(names, values, strict=True))
                try:
                    test(**fixtures, **chosen)
                except Exception as error:
                    raise AssertionError(f'with {chosen}: {error}') from error

        signature = inspect.signature(test)
        run.__signature__ = signature.replace(parameters=[
            parameter for name, parameter in signature.parameters.items() if name not in names])
        return run

    return decorate
