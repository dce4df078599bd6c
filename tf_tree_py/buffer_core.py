# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The buffer with every feature: that of tf2, and those beyond tf2.

Each feature contributes a class of queries, which a snapshot has too, and a class of insertion.
"""

from collections.abc import Callable
import os
from typing import Any, cast

from tf_tree_py.beyond.corrections.absorbing import CorrectedBuffer, CorrectionQueries
from tf_tree_py.beyond.curves.insertion import CurveBuffer
from tf_tree_py.beyond.framed.framed_pose import FramedQueries
from tf_tree_py.beyond.freshness.queries import FreshBuffer, FreshQueries
from tf_tree_py.beyond.prediction.prediction import PredictionQueries
from tf_tree_py.beyond.sources.switching import SourceBuffer, SourceQueries
from tf_tree_py.beyond.uncertainty.insertion import UncertainBuffer
from tf_tree_py.beyond.uncertainty.queries import UncertainQueries
from tf_tree_py.core import fork_locks
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.messages.observers import AUDIT_FOLDER
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.tree_file import load_file, load_tree, save_file, saved_tree
from tf_tree_py.many_stamps import ManyStampQueries, ManyStampSnapshot
from tf_tree_py.outline import as_html


class AllQueries(FramedQueries, FreshQueries, PredictionQueries, UncertainQueries, SourceQueries,
                 CorrectionQueries, ManyStampQueries):
    """All queries of a buffer and of a snapshot."""

    def snapshot(self) -> 'Snapshot':
        """
        Return a copy of the present state, for several lookups that must be consistent.

        It copies the samples, which takes about 20 us for each moving edge with 1,000 samples.
        Ages in it are those at the present time.
        """
        return cast(Snapshot, super().snapshot())

    def _snapshot_of(self, tree: Tree) -> 'Snapshot':
        return Snapshot(tree)

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write the present state to a file, which ``load`` opens at once.

        :param path: such as ``run.tftree``; an existing file is replaced atomically.
        :raises TreeFileError: the file cannot be written; or it cannot contain an edge, because
            its curve or its interpolation is of a class that says nothing about files: see
            ``Curve`` and ``Interpolation``.
        """
        save_file(saved_tree(self.snapshot()._tree, checksum=True), path)

    def smoothed(self) -> 'Snapshot':
        """
        Return a snapshot with all corrections applied to the past, too.

        The live tree is inaccurate during a blend, which avoids jumps, and its past is never
        corrected. In this snapshot every sample has the correction for its own stamp, which is
        interpolated between two corrections. An edge that changed its source has the samples
        of its present source from their beginning. It is meant for maps and post-processing.
        """
        with self._lock:
            still = self.snapshot()
            still._tree = self._smoothed()
        return still

    def _repr_html_(self) -> str:
        """Return the tree as HTML for a notebook."""
        return as_html(self._summary(), Queries.edges(self))

    def record(self, path: str | os.PathLike[str]) -> None:
        """
        Write all present poses to a bag, which ``ros2 bag play`` and viewers open.

        This needs rosbags (``pip install rosbags``). ``open_bag`` restores the same buffer,
        except for data that a bag cannot contain: a spline becomes poses, ten for each of its
        pieces; any other curve becomes 100 poses per second, 100,000 at most; covariances, the
        samples of gyroscopes and interpolations other than ``Linear`` are omitted.

        :param path: of a file, such as ``incident.mcap``; without that suffix, of a folder.
        :raises TreeFileError: the path exists already, or cannot be written.
        """
        from tf_tree_py.recording import bag_writer  # here, because few programs need it
        with self._lock:
            still = self._tree.copy()
        bag_writer.record(still, path)


class BufferCore(AllQueries, FreshBuffer, CurveBuffer, CorrectedBuffer, SourceBuffer,
                 UncertainBuffer):
    """
    Transforms between frames over a window of time, with all lookups and features.

    A lookup costs O(depth log n). The insertion of an edge's newest sample costs O(1)
    amortised.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s by default;
        ``UNLIMITED`` keeps everything.
    :param max_frames: the maximum number of frame names, which limits the damage that a
        hostile publisher can do.
    :param max_name_bytes: the maximum bytes of a frame name in UTF-8, for the same reason.
    :param now: the clock that the stamps are taken from, nanoseconds, such as
        ``time.time_ns``; stamps far ahead of it are reported, and errors suggest a timeout.
        None: all stamps are accepted, and errors assume that no more data arrives.
    :param max_future: how far ahead of the clock a stamp may be, nanoseconds; later stamps
        are refused. None: they are accepted, as in tf2.
    :param max_age: how old the latest transform may be, nanoseconds: the default of all lookups
        of the latest; see ``lookup``. None: any age, as in tf2.
    :param clear_on_jump_back: clear all moving edges when stamps jump back by more than
        this, nanoseconds, as in a looping bag: see ``JumpBack``. None: refuse samples that
        are older than the window, as tf2 does.
    """

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 now: Callable[[], int] | None = None,
                 max_future: int | None = None, clear_on_jump_back: int | None = None,
                 max_age: int | None = None) -> None:
        super().__init__(
            cache_time, max_frames=max_frames, max_name_bytes=max_name_bytes, now=now,
            max_future=max_future, clear_on_jump_back=clear_on_jump_back)
        self._clock = now
        if max_age is not None:
            self.max_age = max_age
        if AUDIT_FOLDER in os.environ:
            from tf_tree_py.reports.audit import watch  # tf_audit runs this program
            watch(self)


class Snapshot(AllQueries, ManyStampSnapshot):
    """
    A buffer's contents at one moment, which never change.

    It supports all queries of a buffer. All its results are consistent with each other,
    regardless of new data in the buffer. It can be pickled, to store it in a file or to send
    it to another process.
    """

    def __getstate__(self) -> dict[str, Any]:
        with self._lock:  # protects the caches of histories; the samples never change
            state = {**self.__dict__, '_tree': saved_tree(self._tree).as_bytes()}
        del state['_lock']
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _tree=load_tree(state['_tree']))
        self._lock = fork_locks.rlock()


def load(path: str | os.PathLike[str], *, verify: bool = False) -> Snapshot:
    """
    Open a file that ``save`` of a buffer wrote; lookups give the same results as the buffer.

    Opening takes a few milliseconds, regardless of the size; lookups read the data from the
    file when they need it, so the file must not be removed.

    :param verify: whether to read the whole file first, and compare it with the checksum that
        ``save`` wrote. Without it, a changed bit in a sample gives a wrong number. The checksum
        detects accidental changes only; a deliberate change can include the checksum.
    :raises TreeFileError: the file cannot be read, is not a saved tree, or is incomplete; or,
        with ``verify``, it has changed since it was written, or has no checksum.
    """
    return Snapshot(load_file(path, verify=verify))
