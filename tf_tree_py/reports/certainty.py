# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The uncertainty of a lookup's answer, and the contribution of each edge."""

from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np
from tf_tree_py.beyond.uncertainty.queries import UncertainQueries
from tf_tree_py.beyond.uncertainty.uncertain import Share
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.so3 import Array


@dataclass(frozen=True)
class Certainty:
    """
    The uncertainty of ``target_T_source``.

    :ivar covariance: (6, 6), see ``lookup_uncertain``.
    :ivar shares: the contribution of each edge that has a covariance, the largest part of the
        position first.
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
    # Rounding may make an eigenvalue of a nearly singular covariance negative.
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def certainty_of(tree: UncertainQueries, target: str, source: str, stamp: int) -> Certainty | None:
    """
    Return the uncertainty of a lookup's answer.

    :param stamp: of the answer, nanoseconds.
    :return: None if no edge between the two has a covariance.
    """
    if not tree.has_covariances:
        return None
    try:
        shares = tree.lookup_budget(target, source, stamp)
        # A buffer of ROS returns a message.
        covariance = (UncertainQueries.lookup_uncertain(tree, target, source, stamp)[1]
                      if shares else None)
    except TransformException:  # the data has expired since the lookup
        return None
    return None if covariance is None else Certainty(covariance, tuple(shares))
