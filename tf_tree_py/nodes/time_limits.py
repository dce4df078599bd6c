# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits on time of a buffer, as parameters of the nodes that have one."""

from typing import Any

from rclpy.duration import Duration
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.ros.waiting.clock import JUMP_BACK

from .parameters import Setting, Values

TIME_LIMITS = (
    Setting('max_future', 0.0, 'refuse stamps further ahead of the clock, s; 0: accept them',
            (0.0, 1e9)),
    Setting('clear_on_jump_back', 0.0,
            'clear moving transforms when stamps jump back by more, s; 0: never', (0.0, 1e9)),
    Setting('clear_on_clock_jump_back', as_seconds(JUMP_BACK),
            'clear them when simulated time goes back by this, s; 0: at any step', (0.0, 1e9)),
)

MAX_AGE = Setting('max_age', 0.0, 'refuse to answer with a latest transform that is older, s; '
                  '0: answer with any', (0.0, 1e9))


def time_limits(given: Values) -> dict[str, Any]:
    """Return the keyword arguments of ``Buffer`` for the values of these parameters."""
    limits: dict[str, Any] = {setting.name: Duration(seconds=given[setting.name])
                              for setting in (*TIME_LIMITS, MAX_AGE) if setting.name in given}
    for name in ('max_future', 'clear_on_jump_back', 'max_age'):
        if not given.get(name):
            limits[name] = None
    return limits
