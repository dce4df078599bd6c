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

"""The parameters of the relay."""

from collections.abc import Mapping
from typing import Any

from tf_tree_py.core.arrivals.frame_names import rename
from tf_tree_py.core.departures.thinning import Thinning
from tf_tree_py.ros.topics.qos import TF_STATIC_TOPIC, TF_TOPIC

from .parameters import FRAME_PREFIX, Setting

NAME = 'tf_relay'

TOPICS = (
    Setting('source_tf_topic', 'tf', 'where the robot publishes what moves'),
    Setting('tf_topic', TF_TOPIC, 'where that goes'),
    Setting('source_tf_static_topic', 'tf_static', 'where it publishes what does not move'),
    Setting('tf_static_topic', TF_STATIC_TOPIC, 'where that goes'),
)
# Which of many samples go out.
THINNING = (
    Setting('rate_hz', 0.0, 'how often each frame goes out at most, by the wall; 0: as often as '
                            'it comes', (0.0, 1000.0)),
    Setting('rates', {}, 'the same for single frames, as the robot calls them', (0.0, 1000.0)),
    Setting('min_move', 0.0, 'metres within which a frame is at rest, and goes out once in '
                             'max_silence; 0 here and for min_turn: it goes out as others do',
            (0.0, 1000.0)),
    Setting('min_turn', 0.0, 'radians, likewise', (0.0, 3.2)),
    Setting('max_silence', 1.0, 'seconds after which a frame at rest goes out all the same',
            (0.001, 3600.0)),
)
# Those that are options of the command line, too.
OPTIONS = (
    Setting('zenoh', '', 'the router that gets the transforms in place of topics, such as '
                         'tcp/hall:7447'),
    Setting('from_zenoh', '', 'the router of a fleet that is to come out on the topics, each '
                              "robot's frames below its name"),
    Setting('robots', '*', "which of its robots, with commas: names, or patterns such as 'hall*'"),
    Setting('robot', '', 'what this robot is called there; none: its namespace'),
    Setting('key_prefix', '', 'what stands in front of the robots in keys of Zenoh'),
    Setting('zenoh_config', '', 'a configuration file of Zenoh (JSON5): TLS, user and password'),
)
SETTINGS = (
    *TOPICS,
    FRAME_PREFIX,
    Setting('shared_frames', [], 'frames that keep their name, such as [map]; of a fleet '
                                 'that comes out on the topics, none: [map]'),
    Setting('frame_filter', [], 'the only frames to pass on, as the robot calls them; none: all'),
    *THINNING,
    *OPTIONS,
)


def thinning_of(values: Mapping[str, Any]) -> Thinning:
    """Return what the parameters say goes out; rates are of frames as they come in."""
    names = rename(frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'])
    renamed = {frame: names(frame, frame) or (frame, frame) for frame in values['rates']}
    return Thinning(
        rate_hz=values['rate_hz'], min_move=values['min_move'], min_turn=values['min_turn'],
        rates={renamed[frame][1]: rate for frame, rate in values['rates'].items()},
        max_silence=values['max_silence'])
