# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The queries of a tree: many poses, and the contents; ``Lookups`` has those of one pose.

The buffer, whose tree changes, and a snapshot, whose tree does not, share them.
"""

from functools import partial
import os
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from .edge_samples import samples_around, stamps_of
from .frozen import freeze, Frozen, thaw, write_frozen
from .lookups import Lookups, Naming
from .many_stamps import poses_at, refuse_missing, warn_of_units
from .outline import as_html, EdgeInfo, info_of, summary
from .tree import Tree
from .. import fork_locks
from ..errors import InvalidArgumentException
from ..geometry.many_poses import Poses
from ..geometry.pose import Pose
from ..stamp import LATEST
from ..times import Stamp, Stamps, StampsLike, without_mask


class Queries(Lookups):
    """The queries of a tree, thread-safe; see ``Lookups`` about stamps."""

    # --- many poses

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['raise'] = 'raise') -> Poses: ...

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['mask']) -> tuple[Poses, npt.NDArray[np.bool_]]: ...

    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: str = 'raise') -> Any:
        """
        Return ``target_T_source`` at many stamps, as one ``lookup`` for each would.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is an ordinary stamp. Masked
            stamps have no answer.
        :param outside: how to treat stamps without an answer: 'raise' an error, or 'mask':
            return NaN for them, and which stamps are valid.
        :return: (N, 7) poses x y z qx qy qz qw, an array with ``@``, ``.inverse()``,
            ``.translation``, ``.rotation`` and ``.as_matrix()``; with 'mask' also (N,)
            booleans.
        :raises InvalidArgumentException: stamps that are not integers, or not of shape (N,).
        :raises TransformException: as in ``lookup``; with 'mask' only if a frame is unknown,
            or the two were never connected.

        The numbers equal those of ``lookup`` to 1e-12 (metres, and components of quaternions);
        for edges longer than 100 metres, to 1e-14 of their length.
        """
        stamps, given = without_mask(stamps)
        array = self._stamps_of(stamps)
        if outside not in ('raise', 'mask'):
            raise InvalidArgumentException(f"outside must be 'raise' or 'mask', not {outside!r}")
        if len(array) and self.observers.hear_lookups():
            return self.observers.watch(
                [(target_frame, source_frame, int(array.max()))],
                self._lookup_many, target_frame, source_frame, array, given, outside)
        return self._lookup_many(target_frame, source_frame, array, given, outside)

    def _lookup_many(self, target_frame: str, source_frame: str, array: Stamps,
                     given: npt.NDArray[np.bool_] | None, outside: str) -> Any:
        with Naming(target_frame, source_frame):
            poses, valid = poses_at(self._tree, self._lock, target_frame, source_frame, array)
        if given is not None:
            valid &= given
            poses[~given] = np.nan
        if outside == 'mask':
            if len(array) and not valid.any():
                warn_of_units(partial(self.lookup_at, target_frame, source_frame), array)
            return Poses(poses), valid
        refuse_missing(partial(self.lookup_at, target_frame, source_frame), array, given, valid)
        return Poses(poses)

    def lookup_tree(self, target_frame: str, stamp: Stamp = LATEST) -> dict[str, Pose]:
        """
        Return ``target_T_frame`` for every frame that can be expressed in the target.

        This is one pass over the tree. A frame is omitted if it has another root, or if an
        edge between it and the target has no data for the stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time for which every moving edge
            of this tree has data.
        :raises LookupException: the target is unknown.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer.
        """
        stamp = self._stamp_of(stamp)
        with self._lock, Naming(target_frame, None):
            if stamp == LATEST:
                stamp = self._tree.spanning.newest_of_all(target_frame)
            poses = self._tree.spanning.poses_from(target_frame, stamp)
        return {frame: Pose._make(pose) for frame, pose in poses.items()}

    # --- contents

    def snapshot(self) -> 'PlainSnapshot':
        """
        Return a copy of the present state, for several lookups that must be consistent.

        It copies the samples, which takes about 20 us for each moving edge with 1,000 samples.
        """
        with self._lock:
            return self._snapshot_of(self._tree.copy())

    def _snapshot_of(self, tree: Tree) -> 'PlainSnapshot':
        return PlainSnapshot(tree)

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write the present state to a file, which ``load`` opens at once.

        :param path: such as ``run.tftree``; an existing file is replaced atomically.
        :raises TreeFileError: the file cannot be written, or a curve is of a kind that files do
            not support: see ``Curve``.
        """
        write_frozen(self._frozen(checksum=True), path)

    def _frozen(self, *, checksum: bool = False) -> Frozen:
        with self._lock:
            still = self._tree.copy()
        return freeze(still, checksum=checksum)

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge with data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [info_of(history.parent, history)
                    for history in histories if history.parent is not None]

    def parents_at(self, stamp: Stamp) -> dict[str, str]:
        """
        Return the parent of each frame at a stamp; frames without data for it have none.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        stamp = self._stamp_of(stamp)
        with self._lock:
            parents = {child: history.parent_at(stamp)
                       for child, history in self._tree.histories.items()}
        return {child: parent for child, parent in parents.items() if parent is not None}

    def stamps_of(self, frame: str) -> Stamps:
        """
        Return the stamps of the samples of a frame's edge to its parent.

        :return: (N,) nanoseconds, sorted; none for a static edge or a root.
        """
        with self._lock:
            return stamps_of(self._tree.histories.get(frame))

    def samples_around(self, child_frame: str, stamp: Stamp) -> list[tuple[int, Pose]]:
        """
        Return the samples of a frame's edge at or next to a stamp, with their own stamps.

        There is one sample if it has exactly this stamp, or if the stamp is outside the stored
        span; there are two between two samples, and none for a static or unknown edge.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        with self._lock:
            return samples_around(self._tree.histories.get(child_frame), self._stamp_of(stamp))

    def __repr__(self) -> str:
        return f'<{self._summary()}>'

    def _repr_html_(self) -> str:
        """Return the tree as HTML for a notebook."""
        return as_html(self._summary(), Queries.edges(self))

    def _summary(self) -> str:
        # ROS's Buffer overrides edges(), and may query the graph for the publishers there.
        return f'{type(self).__name__}: {summary(len(self.frames()), Queries.edges(self))}'


class PlainSnapshot(Queries):
    """
    A buffer's contents at one moment, which never change.

    It supports all queries of a buffer. All its results are consistent with each other,
    regardless of new data in the buffer. It can be pickled, to store it in a file or to send
    it to another process.
    """

    def snapshot(self) -> 'PlainSnapshot':
        """Return this snapshot, because it never changes."""
        return self

    def _frozen(self, *, checksum: bool = False) -> Frozen:
        with self._lock:  # protects the caches of histories; the samples never change
            return freeze(self._tree, checksum=checksum)

    def __getstate__(self) -> dict[str, Any]:
        state = {**self.__dict__, '_tree': self._frozen().as_bytes()}
        del state['_lock']
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _tree=thaw(state['_tree']))
        self._lock = fork_locks.rlock()
