# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read observations from a bag without ROS: from topics, and from frames on /tf."""

from collections.abc import Sequence

from tf_tree_py.bag import Bag, Recording
from tf_tree_py.bag.files.message_types import decode
from tf_tree_py.core import TransformException

from .chain import Tree
from .detections import check_type, Detection, detections_in, gathered
from .errors import CalibrationError
from .observations import Observations

FRAME = 'tf:'
"""The prefix of a target that is a frame on /tf."""


def recorded_observations(recording: Recording, names: Sequence[str], fixed_in: str,
                          known: dict[str, str]) -> list[Observations]:
    """
    Return the observations in a recording.

    :param recording: the result of ``open_bag``.
    :param names: topics, and ``tf:FRAME`` for targets whose frames are on /tf.
    :param fixed_in: the frame in which targets rest.
    :param known: the frames of targets whose place is in the tree, by target; '' is the default.
    :raises CalibrationError: the bag lacks a topic or a frame, or a topic has the wrong type.
    :raises BagError: the bag cannot be read.
    """
    sets: list[Observations] = []
    for name in names:
        if name.startswith(FRAME):
            sets.append(seen_on_tf(recording, name.removeprefix(FRAME), fixed_in, known))
        else:
            sets += gathered(_on_topic(recording, name), fixed_in, known, name)
    return sets


def seen_on_tf(tree: Tree, frame: str, fixed_in: str, known: dict[str, str]) -> Observations:
    """
    Return the samples of a target's frame as observations by the parent frame.

    :raises CalibrationError: the frame does not exist, or is static.
    """
    edge = next((edge for edge in tree.edges() if edge.child == frame), None)
    if edge is None:
        raise CalibrationError(f'the frame {frame!r} was never seen: nothing on /tf has it as a '
                               'child')
    if edge.static:
        raise CalibrationError(f'{edge.parent} -> {frame} is static, so it is not an '
                               'observation by a sensor')
    stamps = tree.stamps_of(frame)
    try:
        poses, _ = tree.lookup_many(edge.parent, frame, stamps, outside='mask')
    except TransformException as error:
        raise CalibrationError(str(error)) from error
    place = known.get(frame, known.get('', ''))
    return Observations(edge.parent, stamps, poses, place or fixed_in, frame,
                        (0.0, 0, 0, 0, 0, 0, 1) if place else None)  # type: ignore[arg-type]


def _on_topic(recording: Recording, topic: str) -> list[Detection]:
    with Bag(recording.path, []) as bag:
        topics = {source.topic: source.type_name for source in bag.everything}
        if topic not in topics:
            there = [f'{name} ({kind})' for name, kind in sorted(topics.items())]
            raise CalibrationError(f'{recording.path} has no topic {topic}; it has: '
                                   f'{", ".join(there) or "nothing"}')
        check_type(topics[topic])
        found: list[Detection] = []
        for arrival in bag.messages(topic):
            source = arrival.source
            try:
                message = decode(source, arrival.data)
            except Exception:  # noqa: B902 - rosbags raises many kinds for damaged bytes
                continue
            found += detections_in(source.type_name, message)
        return found
