# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Queries whose results have names."""

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.queries import Queries

from .framed_pose import FramedPose, Source, Target


class FramedQueries(Queries):
    """Lookups whose results have the names of their frames."""

    def lookup_framed(self, target_frame: Target, source_frame: Source,
                      stamp: Stamp = LATEST) -> FramedPose[Target, Source]:
        """
        Return the pose of ``lookup`` with its frames and its stamp.

        ``a @ b`` composes such poses only if their inner frame names are equal.
        """
        found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
        return FramedPose(target_frame, source_frame, Pose._make(pose), found)
