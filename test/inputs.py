# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parametrization in a single test, whose failure message contains the input."""

from collections.abc import Callable, Iterable
import functools
import inspect
import itertools
from typing import Any


def for_each(**inputs: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """
    Run a test with every input; with every combination, if several arguments have inputs.

    All inputs share the test's fixtures, which therefore must not keep state. The other
    decorators of the test go above this one, except for those of hypothesis.

    :param inputs: the values of each argument.
    """
    names = list(inputs)
    combinations = list(itertools.product(*inputs.values()))
    assert combinations, 'a test without inputs checks nothing'

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        # Do not copy the attributes of hypothesis: it has already run inside ``test``.
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
