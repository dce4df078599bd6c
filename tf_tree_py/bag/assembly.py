"""Messages become the histories of a tree, by the rules of a buffer."""

from collections.abc import Iterable
import threading

from tf_tree_py.core.arrivals.future_guard import FutureGuard
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.observers import Observers
from tf_tree_py.core.buffer.buffer_core import DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.tree.tree import Tree

from .decoding import Decoder
from .oddities import Oddities
from .source import Arrival


class Assembly:
    """
    A tree that is being filled with what was recorded.

    :ivar tree: what there is so far.
    :ivar intake: the way in, which counts.
    :ivar oddities: what was odd so far.
    """

    def __init__(self, decoder: Decoder, cache_time: int) -> None:
        self.tree = Tree(cache_time, DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES)
        self.intake = Intake(self.tree, Waiting(threading.RLock()), Observers(),
                             FutureGuard(None, None), None)
        self.oddities = Oddities()
        self._decoder = decoder

    def take(self, arrivals: Iterable[Arrival]) -> None:
        """Take messages in their order."""
        for arrival in arrivals:
            self._take_carefully(arrival)

    def _take_carefully(self, arrival: Arrival) -> None:
        batch = self._decoder.read(arrival)
        if isinstance(batch, Incident):
            self.intake.refuse(batch)
            self.oddities.note_incidents([batch])
            return
        source = arrival.source
        self.oddities.note_incidents(
            self.intake.take_batch(batch, source.authority, source.static))
