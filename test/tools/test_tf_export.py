# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_export: its files, read by other programs, and its exit status."""

import json
import os
import subprocess
import sys

from bags import BEST_EFFORT, JAZZY, LATCHED, Message, SECOND, write_ros2
import numpy as np
from programs import completed
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.core import Pose
from tf_tree_py.tools.export.formats import FORMATS
from tf_tree_py.tools.export.plan import stamps_in
from tool_helpers import assert_one_sentence, tool

COMMAND = (sys.executable, '-m', 'tf_tree_py.tools.tf_export')
START = 1_700_000_000 * SECOND
IMAGES = [START + number * SECOND // 7 + 5 for number in range(-3, 30)]
FRAMES = ['map', 'camera']


def on_circle(t):
    return Pose.from_xyz_rpy(x=3.0 * np.sin(t), y=-3.0 * np.cos(t), yaw=t)


def image(stamp):
    head = JAZZY.types['std_msgs/msg/Header']
    time = JAZZY.types['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    return JAZZY.serialize_cdr(head(stamp=time, frame_id='camera'), 'std_msgs/msg/Header')


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag of five seconds: base drives in a circle, and has a camera."""
    messages = [Message(START, '/tf_static', [('base', 'camera', 0, tuple(Pose(z=0.5)))], LATCHED)]
    for number in range(251):
        stamp = START + number * SECOND // 50
        pose = tuple(on_circle(number / 50))
        messages.append(Message(stamp, '/tf', [('map', 'base', stamp, pose)]))
    messages += [Message(stamp, '/images', [], BEST_EFFORT, '', 'std_msgs/msg/Header',
                         bytes(image(stamp))) for stamp in IMAGES]
    messages.sort(key=lambda message: message.received)
    return write_ros2(tmp_path_factory.mktemp('export') / 'run', messages)


def export(*arguments, **options):
    return completed(*COMMAND, *map(str, arguments), **options)


def read(path, form):
    """Return the stamps and the other columns of a file, read in the usual way of its format."""
    if form == 'npz':
        columns = np.load(path)
        assert str(columns['target_frame']) == 'map'
        return columns['stamp_ns'], np.hstack([columns[name] for name in columns.files
                                               if columns[name].ndim == 2])
    if form == 'parquet':
        table = pytest.importorskip('pandas').read_parquet(path).to_numpy(dtype=object)
        return table[:, 0].astype(np.int64), table[:, 1:].astype(float)
    if form == 'foxglove':
        return read_foxglove(path)
    if form == 'rrd':
        return read_rrd(path)
    lines = [line for line in path.read_text().splitlines() if line[0] not in '#s']
    cells = [line.replace(',', ' ').split() for line in lines]
    return (np.array([int(row[0].replace('.', '')) for row in cells]),
            np.array([row[1:] for row in cells]).astype(float))


def read_foxglove(path):
    """Return the stamps and poses of an MCAP, from Foxglove's own reader."""
    from mcap.reader import make_reader
    stamps, poses = [], []
    with open(path, 'rb') as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert (schema.name, channel.message_encoding) == ('foxglove.FrameTransforms', 'json')
            transform, = json.loads(message.data)['transforms']
            time = transform['timestamp']
            stamps.append(time['sec'] * SECOND + time['nsec'])
            assert stamps[-1] == message.log_time
            assert (transform['parent_frame_id'], transform['child_frame_id']) == tuple(FRAMES)
            poses.append([*(transform['translation'][axis] for axis in 'xyz'),
                          *(transform['rotation'][axis] for axis in 'xyzw')])
    return np.array(stamps), np.array(poses)


def read_rrd(path):
    """Return the stamps and poses of a recording, from rerun's own reader."""
    from rerun.chunk import RrdReader
    chunk, = (chunk for chunk in RrdReader(path).stream()
              if chunk.entity_path == '/map/camera')
    rows = chunk.to_record_batch()
    poses = [[*position[0], *quaternion[0]] for position, quaternion in zip(
        rows.column('Transform3D:translation').to_pylist(),
        rows.column('Transform3D:quaternion').to_pylist(), strict=True)]
    return rows.column('stamp').to_numpy().astype(np.int64), np.array(poses)


VIEWERS = {'foxglove': 'mcap', 'rrd': 'rerun'}


@pytest.mark.parametrize('form', FORMATS)
def test_every_format_gives_back_stamps_and_poses_to_the_bit(bag, tmp_path, form):
    if form == 'parquet':
        pytest.importorskip('pandas')
        pytest.importorskip('pyarrow')
    path = tmp_path / f'camera.{form}'
    if form in VIEWERS:
        pytest.importorskip(VIEWERS[form], reason=f'pip install {VIEWERS[form]}')
    twist = [] if form == 'tum' or form in VIEWERS else ['--twist']
    assert tool('tf_export', bag, *FRAMES, '--at', '/images', '-o', path, *twist).returncode == 0
    stamps, columns = read(path, form)
    poses, valid = open_bag(bag).lookup_many(*FRAMES, IMAGES, outside='mask')
    assert stamps.tolist() == np.array(IMAGES)[valid].tolist() and 20 < len(stamps) < len(IMAGES)
    if form == 'rrd':  # with float32 numbers
        np.testing.assert_allclose(columns, poses[valid], atol=1e-6)
    else:
        assert columns[:, :7].tolist() == poses[valid].tolist()
    assert columns.shape[1] == (13 if twist else 7)
    # Converting the stamps from one format to the other loses nothing.
    if form in ('tum', 'csv'):
        assert stamps_in(path).tolist() == stamps.tolist()


def test_file_for_foxglove_is_a_recording_for_every_tool(bag, tmp_path):
    pytest.importorskip('mcap')
    path, again = tmp_path / 'camera.mcap', tmp_path / 'again.mcap'
    assert tool('tf_export', bag, *FRAMES, '-o', path).returncode == 0
    assert tool('tf_export', path, *FRAMES, '-o', again).returncode == 0
    assert again.read_bytes() == path.read_bytes()
    stamps, _ = read(path, 'foxglove')
    assert (open_bag(path).lookup_many(*FRAMES, stamps)
            == open_bag(bag).lookup_many(*FRAMES, stamps)).all()
    for name, *arguments in (('tf_doctor',), ('tf_frames',), ('tf_monitor',),
                             ('tf_echo', *FRAMES, '--once'), ('tf_record', '-o', tmp_path)):
        done = tool(name, '--bag', path, *arguments)
        assert (done.returncode, done.stderr) == (0, ''), name


def test_evo_finds_no_error_in_a_known_motion(bag, tmp_path):
    pytest.importorskip('evo', reason='evo is half a gigabyte: pip install evo')
    from evo.core import metrics, sync
    from evo.core.trajectory import PoseTrajectory3D
    from evo.tools.file_interface import read_tum_trajectory_file
    path = tmp_path / 'camera.tum'
    assert tool('tf_export', bag, *FRAMES, '-o', path).returncode == 0
    estimate = read_tum_trajectory_file(path)
    seconds = np.arange(251) / 50
    known = np.array([on_circle(t) @ Pose(z=0.5) for t in seconds])
    truth = PoseTrajectory3D(known[:, :3], known[:, [6, 3, 4, 5]], START / SECOND + seconds)
    assert estimate.num_poses == truth.num_poses
    for relation in ('translation_part', 'rotation_angle_deg'):
        ape = metrics.APE(metrics.PoseRelation[relation])
        ape.process_data(sync.associate_trajectories(truth, estimate))
        assert ape.get_statistic(metrics.StatisticsType.max) < 1e-5


def test_standard_output_has_the_trajectory_and_nothing_else(bag):
    done = export(bag, *FRAMES, '--rate', 10)
    assert (done.returncode, done.stderr) == (0, '')
    title, columns, first, *rest = done.stdout.splitlines()
    assert title == '# camera in map' and columns == '# timestamp_s x_m y_m z_m qx qy qz qw'
    assert first == '1700000000.000000000 0 -3 0.5 0 0 0 1' and len(rest) == 50


def test_json_tells_what_was_written(bag, tmp_path):
    stamps = tmp_path / 'stamps.csv'
    stamps.write_text(f'frame,stamp_ns\na,{START}\nb,{START + SECOND}\nc,{START - 1}\n')
    path = tmp_path / 'camera.csv'
    done = export(bag, *FRAMES, '--at-file', stamps, '--outside', 'nan', '-o', path, '--json')
    assert done.returncode == 0
    assert json.loads(done.stdout) == {
        'version': 1, 'bag': str(bag), 'target': 'map', 'source': 'camera', 'file': str(path),
        'poses': 3, 'outside': 1, 'first_ns': START - 1, 'last_ns': START + SECOND, 'oddities': []}
    assert done.stderr == 'tf_export: 1 stamps have no transform, and have NaN\n'
    assert path.read_text().splitlines()[-1] == f'{START - 1},{",".join(["nan"] * 7)}'


def test_odd_bag_is_told_and_has_a_status_of_its_own(tmp_path):
    pose = tuple(Pose())
    bag = write_ros2(tmp_path / 'odd', [
        Message(START + number, '/tf', [('map', 'camera', START + stamp, pose)])
        for number, stamp in enumerate([0, 10, 10, 5])])
    done = export(bag, *FRAMES)
    assert done.returncode == 1 and len(done.stdout.splitlines()) == 5
    assert 'repeated stamp' in done.stderr and 'out of order' in done.stderr


@pytest.mark.parametrize('arguments, sentence', [
    (['nowhere.mcap', *FRAMES], 'there is no such file'),
    (['BAG', 'map', 'kamera'], "Did you mean 'camera'?"),
    (['BAG', *FRAMES, '--at', '/imu'], 'has no topic /imu; it has: '),
    (['BAG', *FRAMES, '--at', '/images', '--outside', 'fail'], 'stamps have no answer'),
    (['BAG', *FRAMES, '--at-file', 'far.txt'], 'none of 2 stamps has a transform'),
    (['BAG', *FRAMES, '--at-file', 'words.txt'], "line 2: 'one two' has no stamp in column 1"),
    (['BAG', *FRAMES, '--at-file', 'missing.txt'], 'cannot be read: No such file'),
    (['BAG', 'base', 'camera'], 'are static, so they have no stamps to use'),
    (['BAG', *FRAMES, '--twist'], 'TUM files have no velocities'),
    (['BAG', *FRAMES, '-o', 'no/such/folder.tum'], 'cannot be written'),
    (['BAG', *FRAMES, '--format', 'npz'], '-o FILE is missing'),
    (['BAG', *FRAMES, '--json'], '-o FILE is missing'),
    (['BAG', *FRAMES, '-o', 'poses.xlsx'],
     '--format is missing: the suffix .xlsx is that of no format'),
    (['BAG', *FRAMES, '--from', 'now'], "--from: 'now' is not a stamp"),
    (['BAG', *FRAMES, '--to', '1.5'], 'nothing is left between start and stop'),
    (['BAG', *FRAMES, '--rate', '0'], "'0' is not a number greater than zero")])
def test_what_cannot_be_exported_is_one_sentence(bag, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'far.txt').write_text('# seconds\n12.5\n\n13.000000001\n')
    (tmp_path / 'words.txt').write_text('17\none two\n')
    done = tool('tf_export', *(bag if each == 'BAG' else each for each in arguments))
    assert_one_sentence(done, 'tf_export', sentence)
    assert sorted(os.listdir()) == ['far.txt', 'words.txt']


def test_lone_stamp_is_named_where_the_rate_gives_too_many_and_can_be_left_out(bag, tmp_path):
    stamps = [0 if number == 20 else START + number * SECOND // 50 for number in range(101)]
    odd = write_ros2(tmp_path / 'run', [
        Message(START + number * SECOND // 50, '/tf', [('map', 'base', stamp, tuple(Pose()))])
        for number, stamp in enumerate(stamps)])
    done = export(odd, 'map', 'base', '--rate', 50)
    assert (done.returncode, done.stdout) == (2, '')
    for part in ('85000000101 stamps', "lone stamp 'map' -> 'base'", '1970-01-01T00:00:00',
                 f'tf_export --from {START} --to {stamps[-1]}'):
        assert part in done.stderr
    last = f'{stamps[-1] // SECOND}.{stamps[-1] % SECOND:09d}'
    part = ('--format', 'csv', '--from', START, '--to', last)
    for more, count in (('--rate', 50), 101), ((), 100):
        done = export(odd, 'map', 'base', *more, *part)
        assert (done.returncode, len(done.stdout.splitlines())) == (1, count + 1)
        assert "lone stamp 'map' -> 'base'" in done.stderr
        assert f'tf_export --from {START} --to {stamps[-1]}, or start' in done.stderr
        assert 'received at 1700000000.400000000 s' in done.stderr


def test_stamps_of_a_topic_can_be_left_out_at_both_ends(bag):
    kept = [stamp for stamp in IMAGES if START + SECOND <= stamp <= START + 2 * SECOND]
    done = export(bag, *FRAMES, '--at', '/images', '--format', 'csv', '--from', START + SECOND,
                  '--to', START + 2 * SECOND)
    assert [int(line.split(',')[0]) for line in done.stdout.splitlines()[1:]] == kept


def test_closed_pipe_is_no_fault(bag):
    with subprocess.Popen([*COMMAND, bag, *FRAMES, '--rate', '20000'], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == ''
