# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the relay."""

from collections.abc import Mapping
from typing import Any

from tf_tree_py.core.messages.frame_names import rename
from tf_tree_py.ros.topics.qos import TF_STATIC_TOPIC, TF_TOPIC
from tf_tree_py.thinning import Thinner

from .parameters import FRAME_PREFIX, Setting

NAME = 'tf_relay'

TOPICS = (
    Setting('source_tf_topic', 'tf', 'where the robot publishes moving transforms'),
    Setting('tf_topic', TF_TOPIC, 'where to publish them'),
    Setting('source_tf_static_topic', 'tf_static', 'where the robot publishes static transforms'),
    Setting('tf_static_topic', TF_STATIC_TOPIC, 'where to publish them'),
)
# Which samples are sent.
THINNING = (
    Setting('rate_hz', 0.0, 'the highest rate of each frame, Hz of wall time; 0: as often as '
                            'it arrives', (0.0, 1000.0)),
    Setting('rates', {}, 'the same for single frames, by their names on the robot', (0.0, 1000.0)),
    Setting('min_move', 0.0, 'metres within which a frame counts as resting, and is sent once per '
                             'max_silence; 0 here and for min_turn: it is sent like others',
            (0.0, 1000.0)),
    Setting('min_turn', 0.0, 'radians, likewise', (0.0, 3.2)),
    Setting('max_silence', 1.0, 'seconds after which a resting frame is sent anyway',
            (0.001, 3600.0)),
)
# Parameters that are also options of the command line.
OPTIONS = (
    Setting('zenoh', '', 'the router to send the transforms to, instead of topics, such as '
                         'tcp/hall:7447'),
    Setting('from_zenoh', '', 'the router of a fleet to publish on the topics, with the '
                              "robot's name before each frame"),
    Setting('robots', '*', 'which of its robots, comma-separated: names or patterns such as '
                           "'hall*'"),
    Setting('robot', '', 'the name of this robot there; if empty, its namespace'),
    Setting('key_prefix', '', 'the prefix of the robots in Zenoh keys'),
    Setting('zenoh_config', '', 'a Zenoh configuration file (JSON5): TLS, user and password'),
)
SETTINGS = (
    *TOPICS,
    FRAME_PREFIX,
    Setting('shared_frames', [], 'frames that keep their name, such as [map]; with '
                                 'from_zenoh, [map] if empty'),
    Setting('frame_filter', [], 'the only frames to pass on, by their names on the robot; if '
                                'empty, all'),
    *THINNING,
    *OPTIONS,
)


def thinning_of(values: Mapping[str, Any]) -> Thinner:
    """Return the thinner that the parameters describe; its rates use the robot's frame names."""
    names = rename(frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'])
    renamed = {frame: names(frame, frame) or (frame, frame) for frame in values['rates']}
    return Thinner(
        rate_hz=values['rate_hz'], min_move=values['min_move'], min_turn=values['min_turn'],
        rates={renamed[frame][1]: rate for frame, rate in values['rates'].items()},
        max_silence=values['max_silence'])
