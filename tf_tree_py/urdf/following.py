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

"""Who mimics whom: joints whose position is that of another, times something plus something."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.suggest import nearest

from .elements import Element, quoted
from .joints import FIXED, Joint, Mimic


class Followers(NamedTuple):
    """
    What follows when some variables are set, as indices into all variables.

    :ivar columns: (K,) those that follow.
    :ivar leaders: (K,) for each the one that was set.
    """

    columns: npt.NDArray[np.intp]
    leaders: npt.NDArray[np.intp]
    multipliers: Array
    offsets: Array

    def follow(self, values: Array) -> None:
        """Set those that follow in values (..., variables)."""
        if len(self.columns):
            values[..., self.columns] = (
                values[..., self.leaders] * self.multipliers + self.offsets)


def followers(joints: Iterable[Joint], given: Collection[str], columns: Mapping[str, int]
              ) -> Followers:
    """
    Return what follows the variables that are given, also through others that follow.

    A joint that is given itself follows nobody: what was measured counts.

    :param columns: the index of every variable.
    """
    mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
    leaders, found = frozenset(given), []
    for name in mimics:
        leader, multiplier, offset = Mimic(name, 1.0, 0.0)
        while leader not in leaders and leader in mimics:
            step = mimics[leader]
            leader, offset = step.joint, offset + multiplier * step.offset
            multiplier *= step.multiplier
        if leader in leaders and leader != name:
            found.append((columns[name], columns[leader], multiplier, offset))
    parts = list(zip(*found, strict=True)) or [()] * 4
    return Followers(np.array(parts[0], np.intp), np.array(parts[1], np.intp),
                     np.array(parts[2], float), np.array(parts[3], float))


def check_mimics(joints: Sequence[tuple[Joint, Element]]) -> None:
    """
    Check that everybody who follows has somebody to follow.

    :raises DescriptionError: the other joint is not there, never moves, has several positions,
        or follows in its turn whoever follows it.
    """
    by_name = {joint.name: joint for joint, _ in joints}
    for joint, element in joints:
        mimic = element.first('mimic')
        if joint.mimic is None or mimic is None:
            continue
        _check_leader(mimic, joint.mimic.joint, by_name)
        seen = {joint.name: None}
        leader: Mimic | None = joint.mimic
        while leader is not None and leader.joint not in seen:
            seen[leader.joint] = None
            leader = by_name[leader.joint].mimic if leader.joint in by_name else None
        if leader is not None:
            raise mimic.error(f'it mimics itself: {" -> ".join(map(quoted, seen))} -> '
                              f'{quoted(leader.joint)}',
                              'take out one <mimic>, so that somebody leads')


def _check_leader(mimic: Element, name: str, joints: Mapping[str, Joint]) -> None:
    leader = joints.get(name)
    if leader is None:
        meant = nearest(name, joints)
        raise mimic.error(f'it mimics {quoted(name)}, and no joint has that name',
                          f'did you mean {quoted(meant)}?' if meant else
                          'name a joint of this description, or take the <mimic> out')
    if leader.kind == FIXED or len(leader.variables) > 1:
        raise mimic.error(f'it mimics {quoted(name)}, which is {leader.kind}',
                          'name a joint with one position: revolute, continuous or prismatic')
