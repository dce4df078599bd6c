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

"""Who fills a buffer: listeners with their clocks, threads and names, and what they tell."""

from collections.abc import Callable, Iterable
import threading
from typing import Any, Protocol
import weakref

from rclpy.clock import Clock
from rclpy.context import Context
from tf_tree_py.core.arrivals.incident_log import IncidentLog
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.waiting import Waiting

from ..waiting.clock import ClockWatch


class Authority(Protocol):
    """Who publishes on a topic: a name that may be known later."""

    placeholder: str

    def name(self) -> str:
        """Return the name as it is now."""


class Feeds:
    """
    All who fill one buffer; may be called from any thread. Its length is how many.

    :ivar watch: the buffer's clock, which feeds lend.
    """

    def __init__(self, intake: Intake, waiting: Waiting, watch: ClockWatch,
                 on_change: Callable[[bool], None], logger: Any) -> None:
        """
        Begin with nobody.

        :param intake: where what arrives goes.
        :param waiting: who gives up when nobody delivers any more.
        :param on_change: called with the buffer's lock; takes whether there is a feed now.
        :param logger: an rclpy logger.
        """
        self._intake = intake
        self._waiting = waiting
        self.watch = watch
        self._on_change = on_change
        self._count = 0
        # Not their identifiers: those are given to other threads later.
        self._threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
        self._authorities: dict[str, Authority] = {}
        self.log_to(logger)
        on_change(False)

    def __len__(self) -> int:
        return self._count

    def begin(self, clock: Clock, context: Context) -> None:
        """Go by the clock of a listener, as long as it delivers transforms."""
        self._add(1)
        self.watch.use_clock(clock, context)
        self._intake.read_clock_anew()

    def end(self, clock: Clock, context: Context) -> None:
        """Let a listener go; after the last one nobody waits any longer."""
        self.watch.leave(clock, context)
        self._intake.read_clock_anew()
        if not self._add(-1):
            self.watch.release()
            # Some of those who wait give up when nobody delivers any more.
            self._waiting.ask_again()

    def _add(self, change: int) -> int:
        with self._waiting.lock:
            self._count += change
            self._on_change(self._count > 0)
            return self._count

    # --- the threads

    def add_thread(self, thread: threading.Thread) -> None:
        """Note a thread that delivers transforms, and therefore must not wait for them."""
        self._threads.add(thread)

    def remove_thread(self, thread: threading.Thread) -> None:
        """Let a thread wait again that delivered transforms."""
        self._threads.discard(thread)

    def deliver_in(self, thread: threading.Thread) -> bool:
        """Return whether a thread delivers transforms."""
        return thread in self._threads

    @property
    def threads(self) -> list[threading.Thread]:
        """Return the threads that deliver transforms."""
        return list(self._threads)

    # --- the names

    def name_later(self, authority: Authority) -> None:
        """Note an authority that does not know its name yet; ``names`` asks it again."""
        self._authorities[authority.placeholder] = authority

    def names(self) -> dict[str, str]:
        """Return the names that are known now, by their placeholders."""
        return {placeholder: authority.name()
                for placeholder, authority in list(self._authorities.items())}

    # --- what was odd

    def log_to(self, logger: Any) -> None:
        """Write what is odd about arriving transforms to an rclpy logger."""
        self._log = IncidentLog(logger)

    def note(self, incidents: Iterable[Incident]) -> bool:
        """Log what was odd about an insertion; return whether all of it was taken."""
        if not incidents:
            return True
        self._log.report(incidents)
        return not any(incident.refused for incident in incidents)

    def refuse(self, incident: Incident) -> None:
        """Count and log an incident that no insertion returned: bytes that are no message, say."""
        self._intake.refuse(incident)
        self._log.report([incident])
