# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Foxglove's transforms in MCAP give the same tree as the same transforms in TFMessages."""

import json
import os
import struct
import sys
import warnings

from bags import as_cdr, assert_same, driving, fed, RUN, SECOND, START
from effort import examples
from foxglove_messages import (
    CONNECTIONS,
    ENCODERS,
    ENCODERS_OF_ONE,
    fields,
    in_protobuf,
    ROS_TYPE,
    TYPE,
    write_mcap,
    write_run,
)
from hypothesis import given, strategies as st
from programs import completed, without
import pytest
from tf_tree_py.bag import (
    BagError,
    BagWarning,
    Decoder,
    open_bag,
    RecordedMessage,
    stamps_of,
)
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.urdf import Robot
from tool_helpers import tool

ONE = 'foxglove.FrameTransform'
POSE = (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)
ROBOT = Robot.parse('<robot name="arm"><link name="a"/></robot>')


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
    words = '/arm/tf has messages of type tf2_msgs/TFMessage in json, not '
    with pytest.raises(BagError, match=f'{words}transforms that can be read'):
        open_bag(path, topics=['/arm/tf'])
    with pytest.warns(BagWarning, match=f'unread transforms: once: {words}in cdr or ros1'):
        assert_same(open_bag(path), fed(parts['/tf']))
    path = write_mcap(tmp_path / 'mixed.mcap', [
        (each.received, topic, encoding, ENCODERS[encoding](each.transforms))
        for (topic, messages), encoding in zip(parts.items(), ('cdr', 'json'), strict=True)
        for each in messages], profile)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        # By the time of receiving, although the file has one topic after the other.
        assert_same(open_bag(path, topics=topics), fed(sorted(
            [*parts['/tf'], *parts['/arm/tf']], key=lambda message: message.received)))


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


@pytest.mark.parametrize('profile', ['', 'ros2'])
def test_times_of_receiving_beyond_63_bits_crash_nothing(tmp_path, profile):
    messages = [(START, 5), (2**63 + 5, 7), (2**64 - 1, 9)]
    path = write_mcap(tmp_path / 'run.mcap', [
        (received, '/tf', 'cdr', as_cdr([('map', 'base', stamp, POSE)]))
        for received, stamp in messages], profile, 'tf2_msgs/msg/TFMessage')
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', BagWarning)
        [edge] = open_bag(path).edges()
    assert (edge.oldest, edge.latest) == (5, 9)
    done = tool('tf_monitor', '--bag', path)
    assert (done.returncode, done.stderr) == (0, '')


@pytest.mark.parametrize('profile', ['', 'ros2'])
def test_one_topic_of_two_encodings_gives_what_can_be_read(tmp_path, profile):
    messages = driving(count=20)
    path = write_mcap(tmp_path / 'run.mcap', [
        *((each.received, '/tf', 'json', ENCODERS['json'](each.transforms)) for each in messages),
        (START, '/tf', 'cbor', b'\xa0')], profile)
    for topics in None, ['/tf']:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter('always')
            assert_same(open_bag(path, topics=topics), fed(messages))
        assert str(caught[0].message).endswith(
            f'unread transforms: once: /tf has messages of type {TYPE} in cbor, not in json or '
            'protobuf')


@pytest.mark.parametrize(('use', 'type_name'), [
    ({'odometry': '/other'}, 'nav_msgs/msg/Odometry'),
    ({'robot': ROBOT}, 'sensor_msgs/msg/JointState'),
])
def test_other_topics_are_read_only_in_encodings_of_ros(tmp_path, use, type_name):
    path = write_mcap(tmp_path / 'run.mcap', [(START, '/other', 'json', b'{}')], name=type_name)
    words = f'/other has messages of type {type_name.replace("/msg/", "/")} in json, which cannot'
    with pytest.raises(BagError, match=words):
        open_bag(path, **use)
    with pytest.raises(BagError, match=words):
        stamps_of(path, '/other')


def test_joint_states_are_found_beside_others_that_cannot_be_read(tmp_path):
    path = write_mcap(tmp_path / 'run.mcap', [
        (START, '/joint_states', 'cdr', bytes(8)), (START, '/web/joint_states', 'json', b'{}')],
        name='sensor_msgs/msg/JointState')
    with pytest.raises(BagError, match='what was recorded on /joint_states moves no joint'):
        open_bag(path, robot=ROBOT)


def test_stamps_of_transforms_are_not_read(tmp_path):
    path = write_run(tmp_path / 'run', RUN[:3], 'json')
    with pytest.raises(BagError, match=r'in json, of which only the transforms can be read'):
        stamps_of(path, '/tf')


def test_clock_that_is_not_read_is_reported(tmp_path):
    path = write_mcap(tmp_path / 'run.mcap', [
        (START, '/tf', 'json', ENCODERS['json']([('map', 'base', 12, POSE)])),
        (START, '/clock', 'json', b'{}'), (START, '/diagnostics', 'json', b'{}')])
    done = tool('tf_doctor', '--bag', path, '--json')
    assert json.loads(done.stdout)['damage'] == [
        f'/clock has messages of type {TYPE} in json, so ages follow the time of receiving']


@pytest.mark.parametrize(('encoding', 'name', 'words'), [
    ('flatbuffer', TYPE, f'messages of type {TYPE} in flatbuffer, not in json or protobuf'),
    ('xcdr2', ROS_TYPE, 'messages of type foxglove_msgs/FrameTransforms in xcdr2, '
     'not in cdr or ros1'),
    ('cdr', ONE, f'messages of type {ONE} in cdr, not in json or protobuf'),
    ('cdr', 'foxglove_msgs.FrameTransform',
     'messages of type foxglove_msgs.FrameTransform, not tf2_msgs/TFMessage'),
    ('json', '', 'messages without a type in json, not tf2_msgs/TFMessage'),
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
    with pytest.raises(BagError, match=f'/tf has {words.partition(", not")[0]}, not transforms'):
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
    assert words in opened_after(without(missing), path)


OPENING = """
from tf_tree_py.bag import BagError, open_bag
try:
    print(len(open_bag({path!r}, topics={topics}).frames()), 'frames')
except BagError as error:
    print(error)
"""


def opened_after(program, path, topics=None, **environment):
    """Return what a process prints that runs a program, and then opens a bag."""
    done = completed(sys.executable, '-c', program + OPENING.format(path=str(path), topics=topics),
                     env=os.environ | environment)
    assert done.stdout.count('\n') == 1, done.stderr
    return done.stdout


def test_decoder_is_needed_only_for_topics_that_are_read(tmp_path):
    path = write_mcap(tmp_path / 'run.mcap', [
        (START, f'/{encoding}', encoding, ENCODERS[encoding]([('map', 'base', 12, POSE)]))
        for encoding in ('json', 'protobuf')])
    missing = without('foxglove_schemas_protobuf')
    assert 'on /protobuf, needs' in opened_after(missing, path)
    assert opened_after(missing, path, ['/json']) == '2 frames\n'


def test_decoder_for_a_newer_protobuf_is_one_sentence(tmp_path):
    path = write_run(tmp_path / 'run', [RUN[10]], 'protobuf')
    package = tmp_path / 'foxglove_schemas_protobuf'
    package.mkdir()
    (package / '__init__.py').touch()
    (package / 'FrameTransforms_pb2.py').write_text(
        'from google.protobuf.runtime_version import Domain, ValidateProtobufRuntimeVersion\n'
        "ValidateProtobufRuntimeVersion(Domain.PUBLIC, 999, 0, 0, '', 'any.proto')\n")
    folders = os.pathsep.join([str(tmp_path), *sys.path])
    printed = opened_after('', path, PYTHONPATH=folders)
    assert 'Detected' in printed and printed.endswith("'protobuf>=5.29.6'\n")


def test_other_definitions_of_the_same_types_are_no_reason_to_install_anything(tmp_path):
    pytest.importorskip('foxglove_schemas_protobuf')
    path = write_run(tmp_path / 'run', [RUN[10]], 'protobuf')
    printed = opened_after("""
from google.protobuf import descriptor_pb2, descriptor_pool
descriptor_pool.Default().Add(descriptor_pb2.FileDescriptorProto(
    name='foxglove/FrameTransform.proto', package='other'))
""", path)
    assert 'needs foxglove-schemas-protobuf (' in printed and 'pip' not in printed


# --- messages

@pytest.mark.parametrize('encoding', ENCODERS_OF_ONE)
def test_single_transforms_are_read(encoding):
    transform = ('map', 'base', 12, (0.0, -1.0, 1e300, 0.0, 0.0, -1.0, 0.0))
    type_name = CONNECTIONS[encoding].type_name.removesuffix('s')
    data = ENCODERS_OF_ONE[encoding](transform)
    assert read(data, encoding, type_name).samples() == [transform]


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
    ({'translation': {'y': None}}, {'pose': (0.0, 0.0, 0.0, *POSE[3:])}),
    ({'child_frame_id': None}, {'child': ''}),
    ({'timestamp': {'sec': None, 'nsec': 4}}, {'stamp': 4}),
    ({'timestamp': {'sec': -2**31}}, {'stamp': -2**31 * SECOND}),
    ({'timestamp': {'sec': 2**31 - 1, 'nsec': SECOND - 1}}, {'stamp': 2**31 * SECOND - 1}),
    # As it was until 2022.
    ({'translation': ..., 'rotation': ..., 'transform': {
        'timestamp': {'sec': 8}, 'translation': {'x': 9}, 'rotation': {'z': 1}}},
     {'pose': (9.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)}),
    ({'rotation': None, 'transform': {'rotation': {'z': 1}}},
     {'pose': (*POSE[:3], 0.0, 0.0, 1.0, 0.0)}),
    ({'timestamp': None, 'transform': {'timestamp': {'sec': 8}}}, {'stamp': 8 * SECOND}),
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
    (b'{"transforms": [{}]}', 'a transform names no frames'),
    (b'{"parent_frame_id": "map"}', "{'parent_frame_id': 'map'}, not an object with transforms"),
    (b'{"transforms": [' + b'{},' * 100_000 + b'{}]}', '100,001 transforms are more than'),
    (b' ' * 8_000_001, '8,000,001 bytes are more than'),
    (b'{"transforms": [{"position": {"x": 1}, "child_frame_id": "base"}]}',
     'a transform has position, and neither a translation nor a rotation'),
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
    ({'transform': [1]}, 'transform is [1], not an object of timestamp, translation, rotation'),
    ({'transform': {'position': {'x': 1}}}, "transform is {'position': {'x': 1}}, not an object"),
    ({'rotation': {'qw': 1}}, "rotation is {'qw': 1}, not an object of x, y, z, w"),
    ({'timestamp': {'secs': 1}}, "timestamp is {'secs': 1}, not an object of sec, seconds, nsec,"),
    ({'timestamp': {'sec': True}}, 'a timestamp is True, not in integers'),
    ({'timestamp': {'sec': 10**4_000}}, 'the seconds of a timestamp is 1000'),
    ({'timestamp': {'sec': -2**31 - 1}}, 'not from 1901 to 2038'),
    ({'timestamp': '2026-11-30T10:00:00Z'}, "timestamp is '2026-11-30T10:00:00Z', not an object"),
    ({'timestamp': {'sec': 1.5}}, 'a timestamp is 1.5, not in integers'),
    ({'timestamp': {'nsec': SECOND}}, f'the nanoseconds of a timestamp is {SECOND}, not below'),
    ({'timestamp': {'nsec': -1}}, 'the nanoseconds of a timestamp is -1, not below'),
    ({'timestamp': {'sec': 2**31}}, 'not from 1901 to 2038'),
])
def test_wrong_field_is_named(changes, words):
    data = json.dumps({'transforms': [fields('map', 'base', 12, POSE) | changes]}).encode()
    incident = read(data)
    assert (incident.kind, incident.authority) == (Kind.MALFORMED, '/tf')
    assert words in incident.detail and len(incident.detail) < 250


def test_bytes_that_are_not_protobuf_are_refused():
    incident = read(b'\xff\xff', 'protobuf')
    assert incident.kind is Kind.MALFORMED
    assert incident.detail.startswith(f'on /tf: not protobuf of {TYPE}: ')


def test_protobuf_of_another_type_is_refused():
    data = in_protobuf('map', 'base', 12, POSE)
    data.ClearField('timestamp')
    incident = read(data.SerializeToString(), 'protobuf')
    assert incident.detail == f'on /tf: not protobuf of {TYPE}: it has only unknown fields'


def test_json_that_is_nested_as_deep_as_it_can_be_read_is_refused():
    for depth in range(900, 3_000):
        for data in (b'[' * depth + b'0' + b']' * depth,
                     b'{"transforms":[{"parent_frame_id":' + b'[' * depth + b']' * depth + b'}]}'):
            assert read(data).kind is Kind.MALFORMED


def test_protobuf_of_2022_is_refused():
    """Its fourth field was a message of both: as a translation, it would be none."""
    pytest.importorskip('foxglove_schemas_protobuf')
    vector = b'\x09' + struct.pack('<d', 1.0)
    both = b'\x12' + bytes([len(vector)]) + vector
    data = b'\x12\x03map\x1a\x04base\x22' + bytes([len(both)]) + both
    incident = read(data, 'protobuf', ONE)
    assert 'translation has fields that are not in its schema' in incident.detail


def test_received_after_the_last_stamp_is_not_the_stamp():
    data = json.dumps({'parent_frame_id': 'map', 'child_frame_id': 'base'}).encode()
    incident = read(data, type_name=ONE, received=2**64 - 1)
    assert incident.kind is Kind.MALFORMED and 'no message can hold it' in incident.detail


def test_refused_message_has_its_publisher():
    connection = CONNECTIONS['ros1']._replace(publisher='/somebody')
    incident = Decoder().read(RecordedMessage(7, connection, b''))
    assert (incident.kind, incident.authority) == (Kind.MALFORMED, '/somebody')


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
