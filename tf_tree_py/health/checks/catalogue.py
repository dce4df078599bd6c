# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every check; the failure modes of the textbook come first."""

from . import (
    clocks,
    edge_sources,
    frame_name_checks,
    motions,
    publishers,
    rates,
    stamp_order,
    statics,
    structure,
    values,
)
from .check import Check
from .finding import Code

CHECKS: tuple[Check, ...] = (
    structure.loop,
    structure.two_parents,
    publishers.two_publishers,
    structure.unconnected,
    stamp_order.delayed,
    statics.static_republished,
    statics.static_changed,
    publishers.late_joiner,
    motions.interpolated_jump,
    statics.planar_only,
    frame_name_checks.similar_names,
    frame_name_checks.leading_slash,
    frame_name_checks.empty_name,
    structure.self_edge,
    values.not_finite,
    values.not_normalised,
    values.unreadable,
    statics.kind_flips,
    statics.static_late,
    stamp_order.zero_stamps,
    clocks.future_stamps,
    clocks.post_dated,
    clocks.clock_offset,
    clocks.clock_mixture,
    clocks.clock_step,
    clocks.frozen_stamp,
    clocks.whole_seconds,
    stamp_order.jump_back,
    stamp_order.duplicate_stamps,
    stamp_order.out_of_order,
    rates.stale,
    rates.gap,
    rates.irregular_rate,
    rates.slow_for_window,
    rates.skew,
    motions.pose_jump,
    motions.outlier,
    motions.too_fast,
    publishers.qos_mismatch,
    edge_sources.source_silent,
    edge_sources.source_diverged,
)

CODES: dict[str, Code] = {check.code.name: check.code for check in CHECKS}
