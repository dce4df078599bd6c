"""The parameters of the relay."""

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
    Setting('robot', '', 'what this robot is called there; none: its namespace'),
    Setting('key_prefix', '', 'what stands in front of the robots in keys of Zenoh'),
    Setting('zenoh_config', '', 'a configuration file of Zenoh (JSON5): TLS, user and password'),
)
SETTINGS = (
    *TOPICS,
    FRAME_PREFIX,
    Setting('shared_frames', [], 'frames that keep their name, such as [map]'),
    Setting('frame_filter', [], 'the only frames to pass on, as the robot calls them; none: all'),
    *THINNING,
    *OPTIONS,
)
