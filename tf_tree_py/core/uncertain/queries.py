"""The questions to a tree whose edges may be uncertain, as methods beside the plain lookups."""

import numpy.typing as npt

from .lookups import lookup_budget, lookup_uncertain, lookup_uncertain_many, Share, Uncertain
from .prediction import predict, Prediction
from ..arrivals.observers import asked
from ..geometry.pose import Pose
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..tree.queries import Queries, Snapshot


class UncertainQueries(Queries):
    """
    Lookups that say how sure they are.

    A covariance is (6, 6) of x, y, z and rotation about x, y, z, in metres^2 and radians^2,
    as ``PoseWithCovariance`` has it, with the target for the parent: t' = t + dt in the
    target's axes, R' = Exp(dr) R about the target's fixed axes through the source's origin.
    The edges' errors are independent of each other; edges without a covariance are certain.
    """

    def lookup_uncertain(self, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                         independent: bool = False) -> tuple[Pose, Array]:
        """
        Return ``target_T_source`` and its covariance.

        :param stamp: nanoseconds, or ``LATEST``.
        :param independent: whether one edge's errors at two of its stamps have nothing to
            do with each other. Unless told, they may have anything: the answer between two
            stamps is then an upper bound, as it should be for odometry.
        :return: the ``Pose``, and the covariance (6, 6). ROS's ``Buffer`` returns a message.

        Raises as ``lookup`` does.
        """
        found = self._lookup_uncertain(target_frame, source_frame, self._stamp_of(stamp),
                                       independent)
        return Pose._make(found.pose), found.covariance

    def _lookup_uncertain(self, target_frame: str, source_frame: str, stamp: int,
                          independent: bool) -> Uncertain:
        return self.observers.watch(
            [asked(target_frame, source_frame, stamp)],
            lambda: lookup_uncertain(self, target_frame, source_frame, stamp,
                                     independent=independent))

    def lookup_uncertain_many(self, target_frame: str, source_frame: str,
                              stamps: npt.ArrayLike, *,
                              independent: bool = False) -> tuple[Array, Array]:
        """
        Return poses and covariances at many stamps, as ``lookup_uncertain`` one by one.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is a time here.
        :return: (N, 7) and (N, 6, 6).

        Raises as ``lookup_many`` does.
        """
        times = self._stamps_of(stamps)
        lookups = [(target_frame, source_frame, int(times.max()))] if len(times) else []
        return self.observers.watch(
            lookups, lambda: lookup_uncertain_many(self, target_frame, source_frame, times,
                                                   independent=independent))

    def lookup_budget(self, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                      independent: bool = False) -> list[Share]:
        """
        Return what each edge adds to the covariance, the largest part of the position first.

        It answers which calibration is to be improved. To the first order, where the shares
        add up to the covariance of ``lookup_uncertain``. Parameters and errors as there.

        :return: a ``Share`` of each edge that has a covariance.
        """
        stamp = self._stamp_of(stamp)
        return self.observers.watch(
            [asked(target_frame, source_frame, stamp)],
            lambda: lookup_budget(self, target_frame, source_frame, stamp,
                                  independent=independent))

    def predict(self, target_frame: str, source_frame: str, stamp: int,
                horizon: int) -> Prediction:
        """
        Return ``target_T_source`` at a stamp that may lie beyond the newest data.

        Each edge that does not reach the stamp goes on at the mean twist of its last 0.1 s,
        and turns as its gyroscope saw it where it is aided. The covariance says how wrong
        the same prediction, made from earlier samples, would have been, beside what the
        edges' own covariances say; nothing knows of a brake that was never used before.
        A stamp that all data reaches is looked up.

        :param stamp: nanoseconds; ``LATEST`` predicts nothing.
        :param horizon: nanoseconds; no edge is taken further beyond its newest sample.
        :return: the pose, the covariance (6, 6), and how far ``beyond`` the data it went.
        :raises FutureExtrapolationException: an edge ends further away than the horizon.

        The other errors are those of ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        return self.observers.watch(
            [asked(target_frame, source_frame, stamp)],
            lambda: predict(self, target_frame, source_frame, stamp, horizon))

    def snapshot(self) -> Snapshot:
        """Return everything as it is now, for several lookups that must agree."""
        with self._lock:
            return UncertainSnapshot(self._tree.copy())


class UncertainSnapshot(UncertainQueries, Snapshot):
    """A buffer's contents at one moment, with the covariances."""
