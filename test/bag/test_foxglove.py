# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Foxglove's transforms in MCAP give the same tree as the same transforms in TFMessages."""

import json
import sys
import warnings

from bags import as_cdr, assert_same, driving, fed, RUN, SECOND, START
from effort import examples
from foxglove_messages import (
    CONNECTIONS,
    ENCODERS,
    fields,
    in_protobuf,
    TYPE,
    write_mcap,
    write_run,
)
from hypothesis import given, strategies as st
from programs import completed, without
import pytest
from tf_tree_py.bag import BagError, BagWarning, Decoder, open_bag, RecordedMessage
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import Batch

ONE = 'foxglove.FrameTransform'
POSE = (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)


def read(data, encoding='json', type_name=TYPE, topic='/tf', received=7):
    """Return the transforms of one message, or the incident."""
    connection = CONNECTIONS[encoding]._replace(type_name=type_name, topic=topic)
    return Decoder().read(RecordedMessage(received, connection, data))


def sample(changes):
    """Return the sample of a transform in JSON, with some changes to its fields."""
    whole = fields('map', 'base', 5 * SECOND + 9, POSE) | changes
    read_fields = {name: value for name, value in whole.items() if value is not ...}
    [found] = read(json.dumps(read_fields).encode(), type_name=ONE).samples()
    return found


# --- files

@pytest.mark.parametrize(('encoding', 'profile'), [
    *((encoding, profile) for encoding in ('json', 'protobuf')
      for profile in ('', 'ros1', 'ros2')),
    ('cdr', 'ros2'), ('ros1', 'ros1')])
def test_recording_is_the_buffer_that_was_fed(tmp_path, encoding, profile):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        buffer = open_bag(write_run(tmp_path / 'run', RUN, encoding, profile))
    assert_same(buffer, fed(RUN))
    assert buffer.statistics.accepted == sum(len(message.transforms) for message in RUN)


@pytest.mark.parametrize('topics', [None, ['/tf', '/arm/tf']])
@pytest.mark.parametrize('profile', ['', 'ros2'])
def test_topics_of_several_encodings_are_one_tree(tmp_path, profile, topics):
    parts = {'/tf': driving(count=20), '/arm/tf': driving('arm_', 20)}
    encoders = {'/tf': ('cdr', as_cdr), '/arm/tf': ('json', ENCODERS['json'])}
    path = write_mcap(tmp_path / 'run.mcap', [
        (each.received, topic, encoders[topic][0], encoders[topic][1](each.transforms))
        for topic, messages in parts.items() for each in messages], profile,
        'tf2_msgs/msg/TFMessage')
    with pytest.raises(BagError, match='/arm/tf has messages of type tf2_msgs/TFMessage in json'):
        open_bag(path, topics=['/arm/tf'])
    assert_same(open_bag(path), fed(parts['/tf']))
    path = write_mcap(tmp_path / 'mixed.mcap', [
        (each.received, topic, encoding, ENCODERS[encoding](each.transforms))
        for (topic, messages), encoding in zip(parts.items(), ('cdr', 'json'), strict=True)
        for each in messages], profile)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert_same(open_bag(path, topics=topics), fed([*parts['/tf'], *parts['/arm/tf']]))


@pytest.mark.parametrize('encoding', ['json', 'protobuf'])
def test_file_without_an_end_is_read_as_far_as_it_goes(tmp_path, encoding):
    messages = driving(count=200)
    path = write_run(tmp_path / 'run', messages, encoding, chunk_size=3_000)
    path.write_bytes(path.read_bytes()[:50_000])
    with pytest.warns(BagWarning, match='run.mcap is not whole'):
        buffer = open_bag(path)
    count = buffer.statistics.accepted * 2 // 3  # of three transforms in two messages
    assert 50 < count < 390
    assert_same(buffer, fed(messages[:count]))


@pytest.mark.parametrize(('encoding', 'name', 'words'), [
    ('flatbuffer', TYPE, f'messages of type {TYPE} in flatbuffer, not in json or protobuf'),
    ('json', 'foxglove.PoseInFrame',
     'messages of type foxglove.PoseInFrame in json, not tf2_msgs/TFMessage'),
    ('json', 'tf2_msgs/msg/TFMessage',
     'messages of type tf2_msgs/TFMessage in json, not in cdr or ros1'),
])
def test_error_says_what_a_topic_has_that_cannot_be_read(tmp_path, encoding, name, words):
    path = write_mcap(tmp_path / 'run.mcap', [(START, '/tf', encoding, b'{}')], name=name)
    with pytest.raises(BagError) as raised:
        open_bag(path)
    assert str(raised.value) == (
        f'{path} has no topic with transforms; it has: /tf; /tf has {words}')
    with pytest.raises(BagError, match=f'/tf has messages of type {name.replace("/msg/", "/")} in '
                       f'{encoding}, not transforms'):
        open_bag(path, topics=['/tf'])


@pytest.mark.parametrize(('encoding', 'missing', 'words'), [
    ('json', 'foxglove_schemas_protobuf', '3 frames'),
    ('protobuf', 'foxglove_schemas_protobuf', f'reading {TYPE} in protobuf, on /tf, needs '
     "foxglove-schemas-protobuf (No module named 'foxglove_schemas_protobuf'): "
     "pip install foxglove-schemas-protobuf 'protobuf>=5.29.6'"),
    ('protobuf', 'google', "(No module named 'google'): pip install"),
])
def test_missing_decoder_is_one_sentence(tmp_path, encoding, missing, words):
    path = write_run(tmp_path / 'run', [RUN[10]], encoding)
    done = completed(sys.executable, '-c', f"""{without(missing)}
from tf_tree_py.bag import BagError, open_bag
try:
    print(len(open_bag({str(path)!r}).frames()), 'frames')
except BagError as error:
    print(error)
""")
    assert words in done.stdout and done.stdout.count('\n') == 1, done.stderr


# --- messages

def test_single_transforms_are_read():
    pose = (0.0, -1.0, 1e300, 0.0, 0.0, -1.0, 0.0)
    for encoding, data in (('json', json.dumps(fields('map', 'base', 12, pose)).encode()),
                           ('protobuf', in_protobuf('map', 'base', 12, pose).SerializeToString())):
        assert read(data, encoding, ONE).samples() == [('map', 'base', 12, pose)]


@pytest.mark.parametrize(('changes', 'found'), [
    ({'translation': ...}, {'pose': (0.0, 0.0, 0.0, *POSE[3:])}),
    ({'translation': {'y': 4}}, {'pose': (0.0, 4.0, 0.0, *POSE[3:])}),
    ({'rotation': None}, {'pose': (*POSE[:3], 0.0, 0.0, 0.0, 1.0)}),
    ({'rotation': {'z': 1.0}}, {'pose': (*POSE[:3], 0.0, 0.0, 1.0, 0.0)}),
    ({'rotation': {}}, {'pose': (*POSE[:3], 0.0, 0.0, 0.0, 0.0)}),  # which a tree refuses
    ({'timestamp': ...}, {'stamp': 7}),
    ({'timestamp': {}}, {'stamp': 0}),
    ({'timestamp': {'sec': 3}}, {'stamp': 3 * SECOND}),
    ({'timestamp': {'sec': -1, 'nsec': 5}}, {'stamp': 5 - SECOND}),
    ({'child_frame_id': ...}, {'child': ''}),
    ({'more': [1]}, {}),
])
def test_missing_fields_mean_what_they_mean_to_foxglove(changes, found):
    whole = {'parent': 'map', 'child': 'base', 'stamp': 5 * SECOND + 9, 'pose': POSE}
    assert sample(changes)._asdict() == whole | found


def test_fields_that_are_not_set_in_protobuf():
    message = in_protobuf('map', 'base', 12, POSE)
    for name in 'timestamp', 'rotation', 'translation':
        message.ClearField(name)
    data = message.SerializeToString()
    assert read(data, 'protobuf', ONE).samples() == [
        ('map', 'base', 7, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))]
    message.rotation.SetInParent()
    message.timestamp.SetInParent()
    data = message.SerializeToString()
    assert read(data, 'protobuf', ONE).samples() == [('map', 'base', 0, (0.0,) * 7)]


@pytest.mark.parametrize(('data', 'words'), [
    (b'', 'not JSON'),
    (b'\xff', 'not JSON'),
    (b'[' * 100_000, 'not JSON'),
    (b'9' * 5_000, 'not '),  # some Pythons limit the digits of integers
    (b'[]', 'the message is [], not an object'),
    (b'{"transforms": 3}', 'transforms is 3, not a list'),
    (b'{"transforms": [3]}', 'a transform is 3, not an object'),
])
def test_message_that_is_no_frame_transforms_is_refused(data, words):
    incident = read(data)
    assert (incident.kind, incident.authority) == (Kind.MALFORMED, '/tf')
    assert words in incident.detail and len(incident.detail) < 200


@pytest.mark.parametrize(('changes', 'words'), [
    ({'parent_frame_id': 3}, 'parent_frame_id is 3, not text'),
    ({'child_frame_id': '\ud800'}, 'surrogates not allowed'),
    ({'translation': [1, 2, 3]}, 'translation is [1, 2, 3], not an object'),
    ({'translation': {'x': '1'}}, "x is '1', not a number"),
    ({'translation': {'x': True}}, 'x is True, not a number'),
    ({'translation': {'x': 10**400}}, 'not a float'),
    ({'rotation': {'w': None}}, 'w is None, not a number'),
    ({'timestamp': '2026-11-30T10:00:00Z'}, "timestamp is '2026-11-30T10:00:00Z', not an object"),
    ({'timestamp': {'sec': 1.5}}, 'a timestamp is 1.5, not in integers'),
    ({'timestamp': {'nsec': SECOND}}, f'the nanoseconds of a timestamp is {SECOND}, not below'),
    ({'timestamp': {'nsec': -1}}, 'the nanoseconds of a timestamp is -1, not below'),
    ({'timestamp': {'sec': 2**31 + 5}}, 'no message can hold it'),
])
def test_wrong_field_is_named(changes, words):
    data = json.dumps({'transforms': [fields('map', 'base', 12, POSE) | changes]}).encode()
    incident = read(data)
    assert (incident.kind, incident.authority) == (Kind.MALFORMED, '/tf')
    assert words in incident.detail and len(incident.detail) < 250


def test_bytes_that_are_not_protobuf_are_refused():
    incident = read(b'\xff\xff', 'protobuf')
    assert incident.kind is Kind.MALFORMED
    assert incident.detail.startswith(f'not protobuf of {TYPE}: ')


def test_message_without_transforms_is_empty():
    for encoding, data in ('json', b'{}'), ('json', b'{"transforms": null}'), ('protobuf', b''):
        assert read(data, encoding).samples() == []


# --- whatever comes

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(
        st.sampled_from(['sec', 'nsec', 'x', 'y', 'w', 'transforms', '']), inner, max_size=3)),
    max_leaves=6)
NAMES = ['timestamp', 'parent_frame_id', 'child_frame_id', 'translation', 'rotation']
MESSAGES = st.one_of(VALUES, st.fixed_dictionaries({'transforms': st.lists(
    st.one_of(VALUES, st.dictionaries(st.sampled_from(NAMES), VALUES)), max_size=3)}))


@examples(10)
@given(MESSAGES, st.booleans())
def test_any_json_is_a_batch_or_an_incident(message, single):
    found = read(json.dumps(message).encode(), type_name=ONE if single else TYPE)
    assert isinstance(found, (Batch, Incident))


@examples(10)
@given(st.sampled_from(list(ENCODERS)), st.data())
def test_any_bytes_are_a_batch_or_an_incident(encoding, data):
    whole = ENCODERS[encoding]([('map', 'base', 12, POSE), ('base', 'hand', 12, POSE)])
    begin, end = sorted(data.draw(st.tuples(*[st.integers(0, len(whole))] * 2)))
    message = whole[:begin] + data.draw(st.binary(max_size=12)) + whole[end:]
    assert isinstance(read(message, encoding), (Batch, Incident))


# --- Foxglove's own writer

@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
def test_what_its_sdk_records_is_read(tmp_path, compression):
    foxglove = pytest.importorskip('foxglove')
    from foxglove.channels import FrameTransformChannel, FrameTransformsChannel
    from foxglove.mcap import MCAPCompression, MCAPWriteOptions
    from foxglove.messages import FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3

    def made(transform):
        parent, child, stamp, pose = transform
        return FrameTransform(
            timestamp=Timestamp(*divmod(stamp, SECOND)), parent_frame_id=parent,
            child_frame_id=child, translation=Vector3(**dict(zip('xyz', pose[:3], strict=True))),
            rotation=Quaternion(**dict(zip('xyzw', pose[3:], strict=True))))

    path, context = tmp_path / 'sdk.mcap', foxglove.Context()
    several = {topic: FrameTransformsChannel(topic, context=context)
               for topic in ('/tf', '/tf_static')}
    battery = foxglove.Channel('/battery', message_encoding='json', context=context)
    single = FrameTransformChannel('/tf_one', context=context)
    options = MCAPWriteOptions(compression=getattr(MCAPCompression, compression.capitalize()))
    with foxglove.open_mcap(path, context=context, writer_options=options):
        for message in RUN:
            if len(message.transforms) == 1 and message.topic == '/tf':
                single.log(made(message.transforms[0]), log_time=message.received)
            else:
                several[message.topic].log(FrameTransforms(
                    transforms=list(map(made, message.transforms))), log_time=message.received)
        battery.log({'voltage': 12.1})
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert_same(open_bag(path), fed(RUN))
