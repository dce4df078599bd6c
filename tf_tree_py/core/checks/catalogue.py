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

"""Every check; the textbook's failure modes first."""

from . import motions, names, publishers, rates, sources, stamps, statics, structure, values
from .check import Check
from .finding import Code

CHECKS: tuple[Check, ...] = (
    structure.loop,
    structure.two_parents,
    publishers.two_publishers,
    structure.unconnected,
    stamps.delayed,
    statics.static_republished,
    statics.static_changed,
    publishers.late_joiner,
    motions.interpolated_jump,
    statics.planar_only,
    names.similar_names,
    names.leading_slash,
    names.empty_name,
    structure.self_edge,
    values.not_finite,
    values.not_normalised,
    values.unreadable,
    statics.kind_flips,
    stamps.zero_stamps,
    stamps.future_stamps,
    stamps.clock_mixture,
    stamps.jump_back,
    stamps.duplicate_stamps,
    stamps.out_of_order,
    rates.gap,
    rates.irregular_rate,
    rates.slow_for_window,
    rates.skew,
    motions.pose_jump,
    publishers.qos_mismatch,
    sources.source_silent,
    sources.source_diverged,
)

CODES: dict[str, Code] = {check.code.name: check.code for check in CHECKS}
