# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits of findings that users get without options, and a graph that shows nothing."""

from dataclasses import asdict

from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.ros_graph import NO_GRAPH


def test_limits_without_options():
    assert asdict(Thresholds()) == {
        'cache_time': 10_000_000_000, 'max_speed': 10.0, 'max_turn_rate': 30.0,
        'max_delay': 500_000_000, 'max_skew': 1_500_000_000, 'max_usual_speed': 70.0,
        'max_usual_turn_rate': 70.0}


def test_graph_of_a_recording_shows_nothing():
    assert NO_GRAPH._asdict() == {
        'elsewhere': (), 'clock_topic': '/clock', 'clocks': (), 'clock_users': (),
        'simulated': False, 'settled': False}
