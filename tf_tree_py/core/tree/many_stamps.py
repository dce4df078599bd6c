# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One transform at many stamps, with one path for all of them or several.

The buffer's lock is held only while the path is found and its samples are copied, so other threads
do not wait for the arithmetic. What needs more than one path works on a copy of the tree.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import cast

import numpy as np

from .path import Path
from .path_finder import PathFinder
from .tree import Tree
from ..errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
    warn,
)
from ..geometry import se3
from ..geometry.so3 import Array
from ..messages.incidents import TransformWarning
from ..stamp import format_stamp, unit_that_fits
from ..times import Mask, Stamps


def poses_at(tree: Tree, lock: AbstractContextManager[object], target: str, source: str,
             stamps: Stamps) -> tuple[Array, Mask]:
    """
    Return ``target_T_source`` (N, 7) at stamps (N,), and which of them have an answer.

    :param lock: of the tree; held only while samples are copied.
    """
    if target == source:
        return np.tile(se3.IDENTITY, (len(stamps), 1)), np.ones(len(stamps), dtype=bool)
    with lock:
        path, has_changed_parent = _path_for_all(tree.paths, target, source)
        valid = np.zeros(len(stamps), dtype=bool)
        if path is not None:
            oldest, latest = path.span()
            valid = (stamps >= oldest) & (stamps <= latest)
            inside = stamps if valid.all() else stamps[valid]
            track = path.track(*ends_of(inside))
        # At stamps without data on this path, frames may have had other parents.
        still = tree.copy() if has_changed_parent and not valid.all() else None
    if path is not None and inside is stamps:
        return track.poses_at(stamps), valid
    poses = np.full((len(stamps), 7), np.nan)
    if path is not None:
        poses[valid] = track.poses_at(inside)
    if still is not None:
        _add_one_by_one(still.paths, target, source, stamps, poses, valid)
    return poses, valid


def _path_for_all(paths: PathFinder, target: str, source: str) -> tuple[Path | None, bool]:
    """Return the path if it is fixed, else None; and whether any parent ever changed."""
    has_changed_parent = paths.has_changed_parent
    try:
        path = paths.newest_path(target, source)
    except ConnectivityException:
        if not has_changed_parent:
            raise
        return None, True
    return (path if path.fixed else None), has_changed_parent


def _add_one_by_one(paths: PathFinder, target: str, source: str, stamps: Stamps, poses: Array,
                    valid: Mask) -> None:
    """Look up the remaining stamps one by one: frames may have had other parents."""
    for number in np.flatnonzero(~valid).tolist():
        try:
            poses[number] = paths.pose_at(target, source, int(stamps[number]))
        except (ConnectivityException, ExtrapolationException):
            continue
        valid[number] = True


def refuse_missing(lookup_at: Callable[[int], object], stamps: Stamps, given: Mask | None,
                   valid: Mask) -> None:
    """
    Raise the error of the first stamp that has no answer, if there is one.

    :param lookup_at: raises the error of a stamp.
    :param given: which stamps are not masked; None: all of them.
    """
    if valid.all():
        return
    first = int(np.argmin(valid))
    count = len(stamps) - int(valid.sum())
    many = (f'{count} of {len(stamps)} stamps have no answer, the first is stamps[{first}]'
            "{}; lookup_many with outside='mask' returns the others")
    if given is not None and not given[first]:
        raise InvalidArgumentException(many.format(', which is masked'))
    stamp = int(stamps[first])
    try:
        lookup_at(stamp)
    except TransformException as error:
        of_all = many.format(f' = {format_stamp(stamp)} s')
        error.hint = f'{error.hint}. {of_all}' if error.hint else of_all
        raise
    raise InvalidArgumentException(
        f'{count} of {len(stamps)} stamps had no answer at the time of the lookup')


def warn_of_units(lookup_at: Callable[[int], object], stamps: Stamps) -> None:
    """Warn if no stamp has an answer, but the stamps would fit in another unit."""
    try:
        lookup_at(int(stamps[0]))
    except ExtrapolationException as error:
        if None in (error.requested, error.oldest, error.latest):
            return
        meant = unit_that_fits(
            *cast('tuple[int, int, int]', (error.requested, error.oldest, error.latest)))
        if meant:
            warn(f'None of {len(stamps)} stamps has an answer. {meant}', TransformWarning)


def ends_of(stamps: Stamps) -> tuple[int, int]:
    """Return the smallest and the largest of stamps in any order; 0 without stamps."""
    return (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)
