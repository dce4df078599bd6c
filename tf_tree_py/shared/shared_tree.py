# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A buffer that another process fills: the class that users see.

Every method that takes the lock of the tree asks again if the memory lapsed under it; see
``mirror``. That is done here once, for all of them. A function that takes the lock itself, such
as ``lookup_twist``, raises the error.
"""

from collections.abc import Callable, Sequence
import functools
import time
from types import CodeType, FunctionType
from typing import Any, cast, TypeVar

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp

from .attachment import Attachment
from .errors import LapsedException, SharedTreeException
from .mirror import Mirror, MirrorTree
from .place import Place, TOPICS
from .waiting import SharedWaiting

# Only a process that is stopped again and again needs a second one.
_ATTEMPTS = 100
# How often a process that waits for a writer looks for it, seconds.
_LOOK_S = 0.01

_Class = TypeVar('_Class', bound=type)
_Method = TypeVar('_Method', bound=Callable[..., Any])


def _asking_again(method: _Method) -> _Method:
    """Return a method that is called again when the memory that it read was used again."""
    @functools.wraps(method)
    def ask(self: object, *arguments: Any, **named: Any) -> Any:
        for _ in range(_ATTEMPTS):
            try:
                return method(self, *arguments, **named)
            except LapsedException:
                pass
        return method(self, *arguments, **named)
    return cast(_Method, ask)


def _all_ask_again(cls: _Class) -> _Class:
    """Replace all inherited methods of a class that take the lock of the tree."""
    for name in dir(cls):
        # A method may call that of a base class, which takes it.
        methods = [method for base in cls.__mro__
                   if isinstance(method := vars(base).get(name), FunctionType)]
        if name not in vars(cls) and any(_takes_lock(method.__code__) for method in methods):
            setattr(cls, name, _asking_again(methods[0]))
    return cls


def _takes_lock(code: CodeType) -> bool:
    return '_lock' in code.co_names or any(
        _takes_lock(part) for part in code.co_consts if isinstance(part, CodeType))


# The decorators call a method with any arguments, which would cost a tenth of a lookup.
_lookup = BufferCore.lookup_stamped
_lookup_again = _asking_again(_lookup)


@_all_ask_again
class SharedTree(BufferCore, Closable):
    """
    The transforms that ``tf_share`` receives for all processes of this machine.

    It has all lookups of a buffer, and needs neither ROS nor a thread. A lookup reads the memory
    of the other process, so each has the newest transforms. Nothing can be inserted.

    Covariances, curves, corrections and interpolations are not shared.
    """

    tree_class = MirrorTree
    waiting_class = SharedWaiting

    def __init__(self, *, domain_id: int | None = None, topics: Sequence[str] = TOPICS,
                 wait_s: float = 0.0) -> None:
        """
        Attach to the tree of a domain.

        :param domain_id: None: that of ``ROS_DOMAIN_ID``, or 0.
        :param topics: from which ``tf_share`` receives.
        :param wait_s: how long to wait for a process that shares it, seconds.
        :raises SharedTreeException: no process shares it, or it cannot be read.
        """
        super().__init__()
        self._tree.live = True
        self.attachment = _attached(Place(domain_id, topics), wait_s)
        """The file of the other process."""
        assert isinstance(self._tree, MirrorTree) and isinstance(self.waiting, SharedWaiting)
        self._lock = self._mirror = Mirror(self.attachment, self._tree)
        self.waiting.follow(self._mirror, self._tree)
        self.intake.lock = self.waiting.lock
        with self._lock:
            pass

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp, with ``LATEST`` resolved, and the pose; see ``lookup``."""
        try:
            return _lookup(self, target_frame, source_frame, stamp)
        except LapsedException:
            return _lookup_again(self, target_frame, source_frame, stamp)

    def close(self) -> None:
        """Detach; later lookups raise an error."""
        self._mirror.close()
        self.waiting.fail(SharedTreeException('This shared tree has been closed'))


def _attached(place: Place, wait_s: float) -> Attachment:
    end = time.monotonic() + wait_s
    while True:
        try:
            return Attachment(place)
        except SharedTreeException:
            if time.monotonic() >= end:
                raise
        time.sleep(_LOOK_S)
