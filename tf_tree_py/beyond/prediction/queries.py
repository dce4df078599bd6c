# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The query for a pose beyond the newest data."""

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.messages.observers import asked
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.queries import Naming

from .prediction import checked_horizon, predicted, Prediction
from ..uncertainty.queries import UncertainQueries


class PredictionQueries(UncertainQueries):
    """Predictions, thread-safe."""

    def predict(self, target_frame: str, source_frame: str, stamp: Stamp,
                horizon: int) -> Prediction:
        """
        Return ``target_T_source`` at a stamp that may be beyond the newest data.

        Each edge that does not reach the stamp continues at the mean twist of its last 0.1 s,
        and rotates as its gyroscope measured, if it is aided. The covariance has two parts:
        the errors of the same prediction made from earlier samples, and the edges' own
        covariances. It cannot anticipate braking that never occurred before. If all data
        reaches the stamp, the pose is looked up.

        :param stamp: nanoseconds; ``LATEST`` predicts nothing.
        :param horizon: nanoseconds; no edge is predicted further beyond its newest sample.
        :return: the pose, the covariance (6, 6), and how far ``beyond`` the data the pose is.
        :raises FutureExtrapolationException: an edge ends further away than the horizon.

        The other errors are those of ``lookup``.
        """
        stamp, horizon = self._stamp_of(stamp), checked_horizon(horizon)
        if self.observers.hear_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.predict, target_frame, source_frame, stamp, horizon)
        with Naming(target_frame, source_frame):
            with self._lock:
                ahead = predicted(self._tree, target_frame, source_frame, stamp, horizon)
            if ahead is not None:
                return ahead
            found = self._lookup_uncertain(target_frame, source_frame, stamp, False)
        return Prediction(Pose._make(found.pose), found.covariance, found.stamp, 0)
