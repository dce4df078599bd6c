# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The shared parameters of nodes that publish an edge which blends without jumps."""

from typing import Any

from tf_tree_py.beyond.corrections.blend import BlendLimits
from tf_tree_py.core.stamp import from_seconds

from .bad_input import BadInput
from .parameters import Setting

LIMITS = (
    Setting('max_speed', 0.2, 'how fast a blend may move the frame, in addition to its own '
            'motion, m/s', (1e-6, 1e6)),
    Setting('max_turn_rate', 0.1, 'how fast a blend may turn the frame, rad/s', (1e-6, 1e6)),
    Setting('over', 0.3, 'the shortest duration of a blend, seconds', (0.0, 3600.0)),
)


def limits_of(values: dict[str, Any]) -> BlendLimits:
    """Return the limits of the blend, from the parameters in ``LIMITS``."""
    return BlendLimits(
        from_seconds(values['over']), values['max_speed'], values['max_turn_rate'], 0.0)


def frame_of(values: dict[str, Any], key: str) -> str:
    """
    Return the frame that a parameter names, without a leading slash.

    :raises BadInput: it is not the name of a frame.
    """
    name: str = values[key].removeprefix('/')
    if not name:
        raise BadInput(f'parameter {key} must be the name of a frame')
    return name
