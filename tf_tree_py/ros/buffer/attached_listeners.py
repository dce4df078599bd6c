# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The listeners that fill a buffer: their clocks, threads and names, and what they report."""

from collections.abc import Callable, Iterable
import threading
from typing import Protocol
import weakref

from rclpy.impl.rcutils_logger import RcutilsLogger
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.errors import no_truth
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.limited_log import IncidentLog

from ..waiting.clock import ClockWatch, RosClock


class NodeToSpin(Protocol):
    """A node that a program has to spin, because a listener has its subscriptions there."""

    def check(self) -> None:
        """Begin to observe whether it is spun."""

    def why_nothing_arrives(self) -> str:
        """Return that it is not spun, if that is certain, or ''."""


class AttachedListeners:
    """
    All listeners that fill one buffer.

    All methods may be called from any thread. The length is the number of listeners to transforms.

    :ivar watch: the buffer's clock; listeners lend it their clocks.
    :ivar log: the log of what is wrong with arriving messages.
    :ivar side_listeners: the number of listeners to covariances or angular velocities.
    :ivar topics: the full names of the topics to which any listener has subscribed.
    """

    def __init__(self, intake: Intake, waiting: Waiting, watch: ClockWatch,
                 logger: RcutilsLogger) -> None:
        """
        Begin without listeners.

        :param intake: receives what arrives.
        :param waiting: the buffer's queue of waiters; some give up when the last listener ends.
        :param logger: an rclpy logger.
        """
        self._intake = intake
        self._waiting = waiting
        self.watch = watch
        self._count = 0
        self.side_listeners = 0
        self.topics: dict[str, None] = {}
        self._to_spin: list[NodeToSpin] = []
        # Not their identifiers, which are reused by later threads.
        self._threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
        self._name_of: dict[str, Callable[[], str]] = {}
        self.log = IncidentLog(logger)

    def __len__(self) -> int:
        return self._count

    __bool__ = no_truth

    def begin(self, clock: RosClock, to_spin: NodeToSpin | None = None) -> None:
        """
        Follow the clock of a listener as long as it delivers transforms.

        :param to_spin: the node that has to be spun for that; None: it has a separate thread.
        """
        self._add(1)
        if to_spin is not None:
            self._to_spin.append(to_spin)
        self.watch.use_clock(clock)
        self._intake.read_clock_anew()

    def end(self, clock: RosClock, to_spin: NodeToSpin | None = None) -> None:
        """Remove a listener; after the last one, release all waits that need a listener."""
        is_last = not self._add(-1)
        if to_spin is not None:
            self._to_spin.remove(to_spin)
        if is_last:
            # Before its clock leaves: that ends waits, too, but another clock may hide the reason.
            self.watch.release()
        self.watch.leave(clock)
        self._intake.read_clock_anew()
        if is_last:
            # Without a listener some of the waits give up.
            self._waiting.ask_again()

    def _add(self, change: int) -> int:
        with self._waiting.lock:
            self._count += change
            return self._count

    def begin_side_listener(self) -> None:
        """Register a listener to another topic, such as one with covariances."""
        with self._waiting.lock:
            self.side_listeners += 1

    def end_side_listener(self) -> None:
        """Unregister such a listener."""
        with self._waiting.lock:
            self.side_listeners -= 1

    def check_spinning(self) -> Callable[[], str]:
        """
        Begin to observe whether any listener can receive; call this when a wait begins.

        :return: a function for the end of the wait: why nothing arrives, '' if that is not known.
        """
        for node in list(self._to_spin):
            node.check()
        return self._why_nothing_arrives

    def _why_nothing_arrives(self) -> str:
        reasons = [node.why_nothing_arrives() for node in list(self._to_spin)]
        return reasons[0] if reasons and len(reasons) == self._count and all(reasons) else ''

    # --- the threads

    def add_thread(self, thread: threading.Thread) -> None:
        """Register a thread that delivers transforms, and therefore must not wait for them."""
        self._threads.add(thread)

    def remove_thread(self, thread: threading.Thread) -> None:
        """Unregister a thread that delivered transforms: it may wait again."""
        self._threads.discard(thread)

    def deliver_in(self, thread: threading.Thread) -> bool:
        """Return whether a thread delivers transforms."""
        return thread in self._threads

    @property
    def threads(self) -> list[threading.Thread]:
        """Return the threads that deliver transforms."""
        return list(self._threads)

    # --- the names

    def name_later(self, placeholder: str, name: Callable[[], str]) -> None:
        """
        Register an authority whose name is not known yet.

        :param placeholder: replaces the name until then.
        :param name: returns the name that is known now; ``names`` calls it.
        """
        self._name_of[placeholder] = name

    def names(self) -> dict[str, str]:
        """Return the names that are known now, by their placeholders."""
        return {placeholder: name() for placeholder, name in list(self._name_of.items())}

    # --- incidents

    def log_to(self, logger: RcutilsLogger) -> None:
        """Log what is wrong with arriving messages to an rclpy logger."""
        self.log.logger = logger

    def note(self, incidents: Iterable[Incident]) -> bool:
        """Log the incidents of an insertion; return whether nothing was refused."""
        if not incidents:
            return True
        self.log.report(incidents)
        return not any(incident.refused for incident in incidents)

    def refuse(self, incident: Incident) -> None:
        """Count and log an incident that no insertion returned, such as unreadable bytes."""
        self._intake.refuse(incident)
        self.log.report([incident])
