# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The frames that a robot may publish: its own without restriction, and none of others.

Only the key can be checked on arrival; a router's access control may restrict a robot to its keys.
Therefore the frames are put below the robot that the key names.
"""

from collections.abc import Collection

from tf_tree_py.core.messages.frame_names import Rename
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import Batch

from .errors import FleetError


def checked_shared(frames: Collection[str]) -> frozenset[str]:
    """
    Return the frames that all robots share, without leading slashes.

    :raises FleetError: a string instead of a collection of frames.
    """
    if isinstance(frames, str):
        raise FleetError(f'shared_frames has to be a collection, such as ({frames!r},)')
    return frozenset(frame.removeprefix('/') for frame in frames)


def names_below(robot: str, shared: frozenset[str]) -> Rename:
    """Return a function that puts a robot's frames below it; those already there stay."""
    prefix = f'{robot}/'

    def frame(name: str) -> str:
        name = name.removeprefix('/')
        # An empty name stays empty, so that it is refused later.
        kept = not name or name in shared or name.startswith(prefix)
        return name if kept else prefix + name

    return lambda parent, child: (frame(parent), frame(child))


def without_others(batch: Batch, shared: frozenset[str], robot: str
                   ) -> tuple[Batch, list[Incident]]:
    """
    Return a message without edges that attach a shared frame elsewhere, and their incidents.

    :param batch: its frames are below its robot.
    """
    if all(child not in shared for _, child in batch.edges):
        return batch, []
    own = [place for place, (_, child) in enumerate(batch.edges) if child not in shared]
    refused = [_refused(*edge, stamp, robot) for edge, stamp
               in zip(batch.edges, batch.stamps, strict=True) if edge[1] in shared]
    return Batch([batch.edges[place] for place in own], [batch.stamps[place] for place in own],
                 [batch.poses[place] for place in own], batch.slashed), refused


def _refused(parent: str, child: str, stamp: int, robot: str) -> Incident:
    return Incident(
        Kind.NOT_ITS_OWN, parent, child, stamp, robot,
        f'{child!r} is shared by all robots: a robot may attach its frames below it, but not '
        'attach it elsewhere. Do not publish this edge on the robot, or insert it here yourself')
