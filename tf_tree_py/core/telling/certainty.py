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

"""How far the answer of a lookup may be off, and how much each edge adds to that."""

from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np

from ..errors import TransformException
from ..geometry.so3 import Array
from ..tree.queries import Queries
from ..tree.uncertain import Share


@dataclass(frozen=True)
class Certainty:
    """
    How sure ``target_T_source`` is.

    :ivar covariance: (6, 6), see ``lookup_uncertain``.
    :ivar shares: what each edge that has a covariance adds, the largest part of the position
        first.
    """

    covariance: Array
    shares: tuple[Share, ...]

    @property
    def position_sigma(self) -> float:
        """Return the standard deviation of the position in its worst direction, metres."""
        return _worst(self.covariance[:3, :3])

    @property
    def rotation_sigma(self) -> float:
        """Return the standard deviation of the rotation about its worst axis, radians."""
        return _worst(self.covariance[3:, 3:])

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {'sigma_m': self.position_sigma, 'sigma_deg': degrees(self.rotation_sigma),
                'covariance': self.covariance.tolist(),
                'shares': [{'parent': share.parent, 'child': share.child,
                            'position': share.position, 'rotation': share.rotation}
                           for share in self.shares]}


def _worst(covariance: Array) -> float:
    # A variance of a nearly singular covariance may be rounded to less than zero.
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def certainty_of(tree: Queries, target: str, source: str, stamp: int) -> Certainty | None:
    """
    Return how sure a lookup's answer is.

    :param stamp: of the answer, nanoseconds.
    :return: None where no edge between the two has a covariance.
    """
    if not tree.has_covariances:
        return None
    try:
        shares = tree.lookup_budget(target, source, stamp)
        # A buffer of ROS returns a message.
        covariance = Queries.lookup_uncertain(tree, target, source, stamp)[1] if shares else None
    except TransformException:  # the data of a moment ago has expired
        return None
    return None if covariance is None else Certainty(covariance, tuple(shares))
