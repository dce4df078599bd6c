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

"""
What a robot may say: whatever it likes of its own frames, and nothing of others.

All that can be checked on arrival is the key, which a router's access control may hold a
robot to. So the frames are put below the robot that the key names.
"""

from collections.abc import Collection

from tf_tree_py.core.arrivals.frame_names import Rename
from tf_tree_py.core.arrivals.incidents import Incident, Kind
from tf_tree_py.core.arrivals.sample import Batch

from .errors import FleetError


def checked_shared(frames: Collection[str]) -> frozenset[str]:
    """
    Return the frames that all robots share, without leading slashes.

    :raises FleetError: a string where a collection of frames belongs.
    """
    if isinstance(frames, str):
        raise FleetError(f'shared_frames is a collection of frames, such as ({frames!r},)')
    return frozenset(frame.removeprefix('/') for frame in frames)


def names_below(robot: str, shared: frozenset[str]) -> Rename:
    """Return what puts a robot's frames below it; those that are there already stay."""
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
    Return a message without what hangs a shared frame elsewhere, and why that is left out.

    :param batch: its frames below its robot.
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
        f'{child!r} is shared by all robots: a robot may hang its frames below it, and not hang '
        'it elsewhere. Leave this edge out on the robot, or insert it here by hand')
