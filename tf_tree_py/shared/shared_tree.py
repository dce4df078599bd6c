# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Buffers that show the tree of another process.

Every method that takes the lock of the tree asks again if the memory lapsed under it; see
``mirror``. That is done here once, for all of them. A function that takes the lock itself, such
as ``lookup_twist``, raises the error.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
import functools
import threading
import time
from types import CodeType, FunctionType
from typing import Any, cast, TypeVar

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp

from .attachment import Attachment
from .directory import Reception
from .errors import LapsedException, SharedTreeException
from .mirror import Mirror, WhyUnfit
from .mirror_tree import MirrorTree
from .place import Place, TOPICS
from .waiting import SharedWaiting

# Only a process that is stopped again and again needs a second one.
_ATTEMPTS = 100
# How often a process that waits for a writer looks for it, seconds.
_LOOK_S = 0.01

_Method = TypeVar('_Method', bound=Callable[..., Any])
_Lookup = Callable[[Any, str, str, Stamp], tuple[int, PoseTuple]]


# --- asking again

def _asking_again(method: _Method) -> _Method:
    """Return a method that is called again when the memory that it read was used again."""
    @functools.wraps(method)
    def ask(self: object, *arguments: Any, **named: Any) -> Any:
        for _ in range(_ATTEMPTS):
            try:
                return method(self, *arguments, **named)
            except LapsedException as lapsed:
                if lapsed.is_inside:
                    raise
        return method(self, *arguments, **named)
    return cast(_Method, ask)


def _looking_up(lookup: _Lookup) -> _Lookup:
    """Return ``lookup_stamped``, which returns what is known without the lock; see ``mirror``."""
    again = _asking_again(lookup)

    @functools.wraps(lookup)
    def lookup_stamped(self: Any, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> tuple[int, PoseTuple]:
        if (type(stamp) is int and not self.observers.of_lookups
                and (stamp != LATEST or self._max_age is None)):
            found: tuple[int, PoseTuple] | None = self._lock.known(
                target_frame, source_frame, stamp)
            if found is not None:
                return found
        return again(self, target_frame, source_frame, stamp)
    return lookup_stamped


_classes: dict[type[BufferCore], type[BufferCore]] = {}


def _that_asks_again(cls: type[BufferCore]) -> type[BufferCore]:
    """Return a subclass all of whose methods that take the lock of the tree ask again."""
    if cls not in _classes:
        _classes[cls] = type(cls.__name__, (cls,), _asking(cls))
    return _classes[cls]


def _asking(cls: type[BufferCore]) -> dict[str, Any]:
    methods: dict[str, Any] = {name: getattr(cls, name) for name in (
        '__module__', '__qualname__', '__doc__')}
    for name in dir(cls):
        # A method may call that of a base class, which takes it.
        found = [method for base in cls.__mro__
                 if isinstance(method := vars(base).get(name), FunctionType)]
        if any(_takes_lock(method.__code__) for method in found
               if method.__module__.startswith('tf_tree_py.')):
            methods[name] = _asking_again(found[0])
    # That of a program may do more than look up.
    if cls.lookup_stamped.__module__.startswith('tf_tree_py.'):
        methods['lookup_stamped'] = _looking_up(cls.lookup_stamped)
    return methods


def _takes_lock(code: CodeType) -> bool:
    return '_lock' in code.co_names or any(
        _takes_lock(part) for part in code.co_consts if isinstance(part, CodeType))


# --- attaching

def attach(buffer: BufferCore, attachment: Attachment,
           on_thread: Callable[[threading.Thread], object] = lambda _: None,
           why_unfit: WhyUnfit = lambda _: '') -> Mirror:
    """
    Let a buffer show the tree of another process from now on.

    Others have its tree and its waiters already. So these stay the same objects, and become
    instances of other classes.

    :param on_thread: called with each thread that will wake waiters.
    :param why_unfit: see ``Mirror``.
    :return: the lock of the buffer from now on.
    :raises SharedTreeException: the buffer has frames of its own.
    """
    tree, waiting = buffer._tree, buffer.waiting
    with waiting.lock:
        if tree.frames:
            raise SharedTreeException('this buffer has transforms of its own')
        tree.__class__, waiting.__class__ = MirrorTree, SharedWaiting
        assert isinstance(tree, MirrorTree) and isinstance(waiting, SharedWaiting)
        buffer._lock = mirror = Mirror(attachment, tree, cast(Any, waiting.lock), why_unfit)
        buffer.__class__ = _that_asks_again(type(buffer))  # which looks for that lock
        with suppress(SharedTreeException), mirror:  # the next lookup raises it
            pass
        waiting.follow(mirror, tree, on_thread)
    return mirror


def _attachment_to(place: Place, wait_s: float) -> Attachment:
    """
    Return the file of the process that shares a tree at a place.

    :param wait_s: how long to wait for such a process, seconds.
    :raises SharedTreeException: there is none, or its file cannot be read.
    """
    end = time.monotonic() + wait_s
    while True:
        try:
            return Attachment(place)
        except SharedTreeException:
            if time.monotonic() >= end:
                raise
        time.sleep(_LOOK_S)


class SharedTree(BufferCore, Closable):
    """
    The transforms that ``tf_share`` receives for all processes of this machine.

    It has all lookups of a buffer, and needs neither ROS nor a thread. A lookup reads the memory
    of the other process, so each has the newest transforms. Nothing can be inserted.

    Covariances, curves, corrections and interpolations are not shared.
    """

    def __init__(self, *, domain_id: int | None = None, topics: Sequence[str] = TOPICS,
                 wait_s: float = 0.0, now: Callable[[], int] | None = None,
                 max_age: int | None = None) -> None:
        """
        Attach to the tree of a domain.

        :param domain_id: None: that of ``ROS_DOMAIN_ID``, or 0.
        :param topics: from which ``tf_share`` receives.
        :param wait_s: how long to wait for a process that shares it, seconds.
        :param now: the clock that the stamps are taken from, nanoseconds, such as
            ``time.time_ns``: only needed for ``max_age``.
        :param max_age: see ``BufferCore``.
        :raises SharedTreeException: no process shares it, or it cannot be read.
        """
        super().__init__(now=now, max_age=max_age)
        self._show(Place(domain_id, topics), wait_s)

    def _show(self, place: Place, wait_s: float) -> None:
        self._tree.live = True
        self.attachment = _attachment_to(place, wait_s)
        """The file of the other process."""
        self._mirror = attach(self, self.attachment)
        with self._mirror:
            pass

    @property
    def reception(self) -> Reception:
        """Return how the other process receives its transforms, as it said."""
        with self._mirror:
            return self._mirror.directory.reception

    def close(self) -> None:
        """Detach; later lookups raise an error."""
        self._mirror.close()
        self.waiting.fail(SharedTreeException('This shared tree has been closed'))


class PlacedTree(SharedTree):
    """The tree at a place, of which perhaps only the name is known."""

    def __init__(self, place: Place) -> None:
        BufferCore.__init__(self)
        self._show(place, 0.0)
