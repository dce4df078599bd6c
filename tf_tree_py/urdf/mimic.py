# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joints that mimic others: their positions are a multiple of another position, plus an offset."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.text import nearest

from .joints import FIXED, Joint, Mimic
from .xml_elements import Element, quoted

# The greatest multiplier, and offset in metres or radians. No real mechanism has as much.
_LARGEST = 1e9


class MimicJoints(NamedTuple):
    """
    The variables that follow when others are set, as indices into all variables.

    :ivar columns: (K,) the variables that follow.
    :ivar leaders: (K,) the variable that each of them follows.
    :ivar multipliers: (K,)
    :ivar offsets: (K,) metres or radians.
    """

    columns: npt.NDArray[np.intp]
    leaders: npt.NDArray[np.intp]
    multipliers: Array
    offsets: Array

    def follow(self, values: Array) -> bool:
        """Set the followers in values (..., variables); return whether all are finite."""
        if not len(self.columns):
            return True
        with np.errstate(over='ignore'):
            found = values[..., self.leaders] * self.multipliers + self.offsets
        values[..., self.columns] = found
        return bool(np.isfinite(found).all())


def followers(joints: Iterable[Joint], given: Collection[str], columns: Mapping[str, int]
              ) -> MimicJoints:
    """
    Return the variables that follow the given ones, directly or through other followers.

    A variable that is given itself does not follow another one, because it was measured.

    :param given: the names of the given variables.
    :param columns: the index of each variable, by name.
    """
    leaders = frozenset(given)
    found = [(columns[name], columns[mimic.joint], mimic.multiplier, mimic.offset)
             for name, mimic in _resolved(joints, leaders).items()
             if mimic.joint in leaders and mimic.joint != name]
    parts = list(zip(*found, strict=True)) or [()] * 4
    return MimicJoints(np.array(parts[0], np.intp), np.array(parts[1], np.intp),
                       np.array(parts[2], float), np.array(parts[3], float))


def _resolved(joints: Iterable[Joint], leaders: Collection[str] = ()) -> dict[str, Mimic]:
    """
    Return, for each follower, the last joint of its chain and the total multiplier and offset.

    :param joints: without cycles.
    :param leaders: joints that end a chain even if they mimic another joint.
    """
    mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
    known = {name: Mimic(name, 1.0, 0.0) for name in mimics if name in leaders}
    for name in mimics:
        chain = [name]  # the joints whose last joint is not known yet
        while chain[-1] in mimics and chain[-1] not in known:
            chain.append(mimics[chain[-1]].joint)
        last = chain.pop()
        leader, multiplier, offset = known.get(last, Mimic(last, 1.0, 0.0))
        for follower in reversed(chain):
            step = mimics[follower]
            offset = step.multiplier * offset + step.offset
            multiplier *= step.multiplier
            known[follower] = Mimic(leader, multiplier, offset)
    return known


def check_mimics(joints: Sequence[tuple[Joint, Element]]) -> None:
    """
    Check that each joint that mimics another one can follow it.

    :raises DescriptionError: the other joint does not exist, is fixed, has several variables,
        or follows this joint; or a multiplier or an offset is too large.
    """
    by_name = {joint.name: joint for joint, _ in joints}
    mimics = [(joint.name, joint.mimic, written) for joint, element in joints
              if joint.mimic is not None and (written := element.first('mimic')) is not None]
    led: set[str] = set()
    for name, mimic, element in mimics:
        _check_leader(element, mimic.joint, by_name)
        _check_that_it_ends(element, name, by_name, led)
    resolved = _resolved(by_name.values())
    for name, _, element in mimics:
        _check_size(element, resolved[name])


def _check_that_it_ends(element: Element, name: str, joints: Mapping[str, Joint], led: set[str]
                        ) -> None:
    """Follow a chain to its last joint or to a joint in ``led``; add the chain to ``led``."""
    seen = {name: None}
    mimic = joints[name].mimic
    while mimic is not None and mimic.joint not in seen and mimic.joint not in led:
        seen[mimic.joint] = None
        mimic = joints[mimic.joint].mimic if mimic.joint in joints else None
    if mimic is not None and mimic.joint in seen:
        raise element.error(f'it mimics itself: {" -> ".join(map(quoted, seen))} -> '
                            f'{quoted(mimic.joint)}',
                            'remove one <mimic>, so that one joint leads')
    led.update(seen)


def _check_size(element: Element, mimic: Mimic) -> None:
    """Check the total multiplier and offset of a joint."""
    for what, value in (('multiplier', mimic.multiplier), ('offset', mimic.offset)):
        if not abs(value) <= _LARGEST:
            raise element.error(
                f'its {what} with respect to {quoted(mimic.joint)} is {value:g}, which is larger '
                f'than {_LARGEST:g}', f'write the {what} of a real mechanism')


def _check_leader(mimic: Element, name: str, joints: Mapping[str, Joint]) -> None:
    leader = joints.get(name)
    if leader is None:
        meant = nearest(name, joints)
        raise mimic.error(f'it mimics {quoted(name)}, but no joint has that name',
                          f'did you mean {quoted(meant)}?' if meant else
                          'name a joint of this description, or remove the <mimic>')
    if leader.kind == FIXED or len(leader.variables) > 1:
        raise mimic.error(f'it mimics {quoted(name)}, which is {leader.kind}',
                          'name a joint with one variable: revolute, continuous or prismatic')
