# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The exceptions of tf2, with their facts as attributes; and warnings.

The five classes of tf2_py keep tf2's names and meaning, and each can be raised with only
a text. An error of this package also has attributes: the edge, the requested and the
available stamps, the duration of the wait, and a hint. Its text, and the hint, are computed only
when they are read: most errors of repeated lookups never are. ``hints`` has the texts.

If a program has imported tf2_py, an ``except`` with tf2_py's classes catches these, too.

A warning is at the line of the caller, no matter how deep in the package it arises.

The rules:

- An error belongs to the thread that raises it, which adds the frames, the wait and the hint. What
  keeps an error for others, such as a future, raises copies: threads must not share a traceback.
- A hint holds values, never a tree: it is computed when it is read, in any thread and without a
  lock.
- ``blocked_on`` has every edge that may change the outcome. A lookup sleeps through the arrival of
  its data if its edge is missing there.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
import os
import sys
from types import FrameType, ModuleType
from typing import NoReturn
import warnings

from .stamp import format_span, format_stamp, LATEST
from .text import shorten

# (child, stamp): a failed lookup may succeed when the newest sample of this child frame has
# reached this stamp, or when the structure of the tree changes. If child is None, only a change
# of the structure can help.
Blocker = tuple[str | None, int]
ANY_STRUCTURE: tuple[Blocker, ...] = ((None, LATEST),)


Hint = str | Callable[[bool], str]
"""
A hint how to solve a problem: one sentence, or a function that returns it.

The function is called when the hint is read. Its argument is whether data may still arrive.
"""


def no_truth(thing: object) -> NoReturn:
    """
    Refuse to be true or false, as the ``__bool__`` of a class that has a length.

    Otherwise Python would ask for the length, which some classes take long to count; and a
    thing that exists, but is empty, would pass for None.

    :raises TypeError: always.
    """
    raise TypeError(
        f'{type(thing).__name__} has no truth value: compare it with None, or use len()')


class TreeFileError(Exception):
    """
    A file with transforms cannot be read or written; the text is one sentence.

    Programs print it and exit with status 2.
    """


class JoinableException(Exception):
    """
    A separate base, so that ``join`` can add bases to the classes below.

    Python does not change the bases of a class whose only base is ``Exception``.
    """


# The modules whose classes are bases of ours, by name.
_joined: dict[str, ModuleType | None] = {}


def join(module: str, classes: Iterable[type[JoinableException]]) -> None:
    """
    Make another module's exceptions bases of our classes with the same names, if it is loaded.

    Then an ``except`` with its classes catches ours. An ``except`` uses the real bases of a
    class, so there is no simpler way. Our exceptions call this function in their constructor.
    It imports nothing: importing tf2_py and rclpy takes time, and a program that catches
    tf2_py's classes has imported tf2_py.

    :param module: the name of the module.
    :param classes: our classes, base classes first.
    """
    theirs = sys.modules.get(module)
    if theirs is _joined.get(module):
        return
    if not all(hasattr(theirs, ours.__name__) for ours in classes):
        return  # It is still being imported.
    for ours in classes:
        other = getattr(theirs, ours.__name__)
        # This fails if a program has a class with both as bases and the new order is impossible.
        with suppress(TypeError):
            if not issubclass(ours, other):
                ours.__bases__ = (*ours.__bases__, other)
    _joined[module] = theirs


class TransformException(JoinableException):
    """
    Base of all exceptions of a transform buffer.

    An attribute is None where the error has no such fact.

    :ivar target_frame: the target of the lookup.
    :ivar source_frame: the source of the lookup.
    :ivar waited_s: how long the caller waited, seconds.
    :ivar blocked_on: (child frame, stamp) of all edges that may change the result when
        their newest sample reaches that stamp. None: waiting cannot help.
    :ivar parent: the parent frame of the edge without data; None also if it has no samples.
    :ivar child: the edge's child frame.
    :ivar requested: the requested stamp, nanoseconds.
    :ivar oldest: the oldest stored stamp of this edge; None also if it has no samples.
    :ivar latest: the newest one.
    """

    parent: str | None = None
    child: str | None = None
    requested: int | None = None
    oldest: int | None = None
    latest: int | None = None

    def __init__(self, *arguments: object, target_frame: str | None = None,
                 source_frame: str | None = None, hint: Hint = '',
                 blocked_on: tuple[Blocker, ...] | None = None) -> None:
        """
        Take any arguments, as ``Exception`` and tf2's classes do; usually one text.

        :param hint: how to solve the problem; see ``Hint``.
        """
        join('tf2_py', _OF_TF2)
        super().__init__(*[shorten(argument) if isinstance(argument, str) else argument
                           for argument in arguments])
        self.target_frame = target_frame
        self.source_frame = source_frame
        self._hint = hint
        self._live = False
        self.blocked_on = blocked_on
        self.waited_s: float | None = None

    @property
    def hint(self) -> str:
        """Return a hint how to solve the problem: one sentence, or ''."""
        if not isinstance(self._hint, str):
            self._hint = self._hint(self._live)
        return self._hint

    @hint.setter
    def hint(self, hint: Hint) -> None:
        self._hint = hint

    def in_lookup(self, target_frame: str, source_frame: str | None, live: bool) -> None:
        """
        Add the frames of the lookup that failed.

        :param live: whether data may still arrive in the buffer.
        """
        self.target_frame, self.source_frame, self._live = target_frame, source_frame, live

    def describe(self) -> str:
        """Return the problem in one sentence, without the wait and the hint."""
        return Exception.__str__(self)

    def __repr__(self) -> str:
        return f'{type(self).__name__}({str(self)!r})'

    def __str__(self) -> str:
        text = shorten(self.describe())
        if self.waited_s is not None:
            text += f' (waited {self.waited_s:.3f} s for it)'
        # The hint has its own line, because many programs log this 30 times a second.
        return f'{text}.\n{shorten(self.hint)}' if self.hint else text


class InvalidArgumentException(TransformException):
    """An argument is invalid regardless of the buffer: a frame name, a stamp, a shape."""


class ArgumentTypeException(InvalidArgumentException, TypeError):
    """An argument has an invalid type, such as float seconds for a stamp."""


class LookupException(TransformException):
    """The frame has not been published."""


class ConnectivityException(TransformException):
    """The two frames are in different trees."""


class TimeoutException(TransformException):
    """A remote buffer did not answer in time."""


class ExtrapolationException(TransformException):
    """An edge on the path, from ``parent`` to ``child``, has no data for the stamp."""

    def __init__(self, *arguments: object, parent: str | None = None,
                 child: str | None = None, requested: int | None = None,
                 oldest: int | None = None, latest: int | None = None, hint: Hint = '',
                 blocked_on: tuple[Blocker, ...] | None = None) -> None:
        super().__init__(*arguments, hint=hint, blocked_on=blocked_on)
        self.parent = parent
        self.child = child
        self.requested = requested
        self.oldest = oldest
        self.latest = latest

    def describe(self) -> str:
        """Return a sentence that names the edge without data for the stamp, and the reason."""
        if self.requested is None:
            return super().describe()
        return f'{self._problem()}, the edge {self.parent} -> {self.child}{self._query()}'

    def _problem(self) -> str:
        return 'Lookup would require extrapolation'

    def _query(self) -> str:
        if self.target_frame is None:
            return ''
        return (f', when looking up transform from frame [{self.source_frame}] '
                f'to frame [{self.target_frame}]')


class FutureExtrapolationException(ExtrapolationException):
    """The stamp is newer than the newest sample of an edge; data for it may still arrive."""

    def _problem(self) -> str:
        assert self.requested is not None and self.latest is not None
        return ('Lookup would require extrapolation into the future. Requested time '
                f'{format_stamp(self.requested)} but the latest data is at time '
                f'{format_stamp(self.latest)}, {format_span(self.requested - self.latest)} older')


class PastExtrapolationException(ExtrapolationException):
    """The stamp is older than the oldest sample of an edge."""

    def _problem(self) -> str:
        assert self.requested is not None and self.oldest is not None
        return ('Lookup would require extrapolation into the past. Requested time '
                f'{format_stamp(self.requested)} but the earliest data is at time '
                f'{format_stamp(self.oldest)}, {format_span(self.oldest - self.requested)} newer')


class NoDataException(ExtrapolationException):
    """An edge is known but has no sample, for example after a clear."""

    def describe(self) -> str:
        """Return a sentence that names the edge without samples."""
        if self.child is None:
            return super().describe()
        return ('Unable to lookup transform, cache is empty: no data for the edge above frame '
                f'[{self.child}]{self._query()}')


class ClockJumpException(ExtrapolationException):
    """The clock jumped back while a lookup waited, and the buffer was cleared."""


_OF_TF2 = (TransformException, InvalidArgumentException, LookupException, ConnectivityException,
           TimeoutException, ExtrapolationException)
join('tf2_py', _OF_TF2)


# --- warnings

_FOLDER = os.path.join(sys.modules[__name__.partition('.')[0]].__path__[0], '')
# They call callbacks of the package, and import its modules.
_BETWEEN = {'importlib', 'rclpy'}


def warn(text: str, category: type[Warning] = UserWarning) -> None:
    """
    Issue a Python warning at the line that called the package.

    ``skip_file_prefixes`` of Python 3.12 does the same. A ``stacklevel`` would be wrong for each
    caller that is a function nearer or further away.
    """
    frame = sys._getframe()
    while frame.f_back is not None and _is_between(frame):
        frame = frame.f_back
    names = frame.f_globals
    warnings.warn_explicit(text, category, frame.f_code.co_filename, frame.f_lineno,
                           names.get('__name__', '<string>'),
                           names.setdefault('__warningregistry__', {}))


def _is_between(frame: FrameType) -> bool:
    """Return whether a frame is between the caller and the warning."""
    # Not the file of its code: that of a method that dataclass generates is '<string>'.
    names = frame.f_globals
    return ((names.get('__file__') or '').startswith(_FOLDER)
            or names.get('__name__', '').partition('.')[0] in _BETWEEN)
