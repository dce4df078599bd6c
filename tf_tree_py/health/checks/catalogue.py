# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every check; the failure modes of the textbook come first."""

from . import clocks, graph, poses, rates, samples, structure
from .finding import Check

CHECKS: tuple[Check, ...] = (
    structure.loop,
    structure.two_parents,
    structure.two_publishers,
    structure.unconnected,
    samples.delayed,
    poses.static_republished,
    poses.static_changed,
    structure.late_joiner,
    poses.interpolated_jump,
    poses.planar_only,
    structure.similar_names,
    structure.leading_slash,
    structure.empty_name,
    structure.self_edge,
    samples.not_finite,
    samples.not_normalised,
    samples.unreadable,
    samples.impossible_stamp,
    poses.kind_flips,
    poses.static_late,
    samples.zero_stamps,
    clocks.future_stamps,
    clocks.post_dated,
    clocks.clock_offset,
    clocks.clock_mixture,
    clocks.clock_step,
    samples.recorder_clock,
    clocks.clock_drift,
    clocks.frozen_stamp,
    clocks.whole_seconds,
    samples.lone_stamp,
    samples.jump_back,
    samples.duplicate_stamps,
    samples.out_of_order,
    rates.stale,
    rates.gap,
    rates.irregular_rate,
    rates.slow_for_window,
    rates.skew,
    poses.pose_jump,
    poses.moved_once,
    poses.outlier,
    poses.too_fast,
    structure.qos_mismatch,
    structure.source_silent,
    structure.source_diverged,
    graph.other_topic,
    graph.no_clock,
    graph.two_clocks,
)

CODES = {check.name: check for check in CHECKS}
