# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Deprecated public names: they work for a while, and warn when they are used.

docs/stability.md states which names are public, and how long a deprecated name is kept.
"""

from collections.abc import Callable, Collection, Mapping
from functools import wraps
import sys
from typing import Any, TypeVar
import warnings

Function = TypeVar('Function', bound=Callable[..., Any])


def deprecated(instead: str, until: str) -> Callable[[Function], Function]:
    """
    Return a decorator for a function or method that will be removed.

    :param instead: its replacement.
    :param until: the version that removes it.
    """
    def decorate(function: Function) -> Function:
        text = _text(function.__qualname__, instead, until)

        @wraps(function)
        def warn_and_call(*args: Any, **kwargs: Any) -> Any:
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return function(*args, **kwargs)

        return warn_and_call  # type: ignore[return-value]
    return decorate


def renamed_parameter(old: str, new: str, until: str) -> Callable[[Function], Function]:
    """
    Return a decorator for a function that still accepts the old name of a keyword argument.

    :param until: the version that removes the old name.
    """
    def decorate(function: Function) -> Function:
        text = _text(f'{function.__qualname__}({old}=)', f'{new}=', until)

        @wraps(function)
        def rename_and_call(*args: Any, **kwargs: Any) -> Any:
            if old in kwargs:
                if new in kwargs:
                    raise TypeError(f'{function.__qualname__}() got {old} and {new}')
                warnings.warn(text, DeprecationWarning, stacklevel=2)
                kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return rename_and_call  # type: ignore[return-value]
    return decorate


def renamed(module: str, names: Mapping[str, str], until: str,
            otherwise: Callable[[str], Any] | None = None) -> Callable[[str], Any]:
    """
    Return a module's ``__getattr__`` (PEP 562) that finds its old names.

    ``__getattr__ = renamed(__name__, {'old_name': 'new_name'}, until='0.3')``

    :param otherwise: finds all other names, if the module loads some of them on first use.
    :raises AttributeError: the name is neither in the module nor an old name.
    """
    def find(name: str) -> Any:
        if name in names:
            text = _text(f'{module}.{name}', f'{module}.{names[name]}', until)
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return getattr(sys.modules[module], names[name])
        if otherwise is not None:
            return otherwise(name)
        raise AttributeError(f'module {module!r} has no attribute {name!r}')
    return find


def moved(module: str, names: Collection[str], to: str, until: str) -> Callable[[str], Any]:
    """
    Return a function that finds names of a module which are public in another one now.

    The old module's own ``__getattr__`` calls it, so the old module need not know the names.

    :param to: the other module, which is imported already.
    :raises AttributeError: the name is not one of them.
    """
    def find(name: str) -> Any:
        if name in names:
            warnings.warn(_text(f'{module}.{name}', f'{to}.{name}', until), DeprecationWarning,
                          stacklevel=3)  # behind __getattr__
            return getattr(sys.modules[to], name)
        raise AttributeError(f'module {module!r} has no attribute {name!r}')
    return find


def _text(name: str, instead: str, until: str) -> str:
    return f'{name} is deprecated and will be removed in {until}: use {instead}'
