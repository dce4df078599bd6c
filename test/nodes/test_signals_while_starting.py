# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
SIGINT and SIGTERM at many moments of the start of every executable.

The starting process is forked at each of these moments, and each child receives a signal at
once. An executable thus starts once for all moments, and the children end quickly. A program that
only reads a file may end before it handles signals itself; then its whole run is its start.
"""

from importlib.metadata import distribution
import json
import os
from pathlib import Path
import sys

from bags import LATCHED, Message, write_ros2
from calibration_scenes import EDGE, scene, START
from programs import completed, PATIENCE_S
import pytest
import tf_tree_py

ENTRIES = {script.name: script.value for script in distribution('tf_tree_py').entry_points.select(
    group='console_scripts')}
BAG = ['--bag', '{}/run']
CALIBRATE = ['--edge', *EDGE, '--observations', 'tf:tag', '--fixed-in', 'map']
# The command lines of executables that need more than their name; {} is a folder.
ARGUMENTS = {
    'tf_archive': [['report', '{}/run', '-o', '{}/report']],
    'tf_audit': [['--', 'true']],
    'tf_calibrate': [CALIBRATE, [*BAG, *CALIBRATE]],
    'tf_doctor': [[], BAG],
    'tf_echo': [['map', 'base'], ['map', 'base', *BAG]],
    'tf_export': [['map', 'base', '{}/run', '-o', '{}/poses.tum']],
    'tf_frames': [[], BAG],
    'tf_lab': [['order']],
    'tf_monitor': [[], BAG],
    'static_transform_publisher': [['--frame-id', 'a', '--child-frame-id', 'b']],
    'tf_view': [[], BAG, ['--urdf', '{}/robot.urdf']],  # the mesh makes it import trimesh
    'urdf_broadcaster': [['--urdf', '{}/robot.urdf']],
    'robot_state_publisher': [['{}/robot.urdf']],
}
STARTS = [(name, arguments) for name in sorted(ENTRIES)
          for arguments in ARGUMENTS.get(name, [[]])]
# This one never starts anything that must end in order.
ENDS_BY_ITSELF = ('tf_calibrate', [*BAG, *CALIBRATE])
ROBOT = """<robot name="r"><link name="base"><visual><geometry>
<mesh filename="mesh.stl"/></geometry></visual></link></robot>"""
MESH = """solid m
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid m
"""

# The moments are events of the import system, which holds locks and catches exceptions. The
# distances between them increase, because starts have different lengths.
PROGRAM = """
import json, os, signal, sys, time
from importlib import import_module
from tf_tree_py.command import signals

PATIENCE_S = float(sys.argv[1])
entry, arguments = sys.argv[2], sys.argv[3:]
MOMENTS = {int(1.2 ** power) for power in range(40)}
events, statuses, in_child, watching = 0, [], False, True

def signalled_child(number):
    # Return True in a child, which goes on from here with a signal.
    global in_child
    child = os.fork()
    if not child:
        in_child = True
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1), os.dup2(silence, 2)
        os.kill(os.getpid(), number)
        return True
    deadline = time.monotonic() + PATIENCE_S
    while not (done := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.001)
    statuses.append(os.waitstatus_to_exitcode(done[1]))
    return False

def signalled_children():
    return any(map(signalled_child, (signal.SIGINT, signal.SIGTERM)))

def watch(event, _):
    global events, watching
    if in_child or not watching or event not in ('import', 'open', 'exec'):
        return
    events += 1
    if events in MOMENTS:
        watching = False
        watching = not signalled_children()

def begin(*_):
    # The start is over: what is done from now on has to end in order.
    if in_child or signalled_children():
        os._exit(77)
    report('began')

def end():
    # The work is done, and signals no longer matter.
    if in_child:
        os._exit(77)
    report('ended')

def report(what):
    print(json.dumps([what, events, statuses]), flush=True)
    os._exit(0)

signals.raise_interrupts = signals.call_on_signal = begin
signals.ignore = end
module, _, name = entry.partition(':')
start = getattr(import_module(module), name)
sys.argv = [name, *arguments]
sys.addaudithook(watch)
start()
"""


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with a robot description and a recording for a calibration."""
    folder = tmp_path_factory.mktemp('files')
    (folder / 'robot.urdf').write_text(ROBOT)
    (folder / 'mesh.stl').write_text(MESH)
    buffer, seen, _ = scene(1, 80, duration_s=8.0)
    stamps = buffer.stamps_of('base')
    tracks = [('map', 'base', stamps, buffer.lookup_many('map', 'base', stamps)),
              ('camera', 'tag', seen.stamps, seen.seen)]
    messages = [Message(stamp, '/tf', [(parent, child, stamp, tuple(pose))])
                for parent, child, stamps, poses in tracks
                for stamp, pose in zip(stamps.tolist(), poses.tolist(), strict=True)]
    mounting = (*EDGE, 0, tuple(buffer.lookup(*EDGE)))
    write_ros2(folder / 'run', [Message(START - 2 * 10**9, '/tf_static', [mounting], LATCHED),
                                *sorted(messages, key=lambda message: message.received)])
    return folder


def run(program, *arguments):
    """Run a program with the package that is tested."""
    paths = [str(Path(tf_tree_py.__file__).parents[1]), os.environ.get('PYTHONPATH', '')]
    return completed(sys.executable, '-W', 'ignore', '-c', program, *arguments,
                     env={**os.environ, 'PYTHONPATH': os.pathsep.join(paths)})


@pytest.mark.parametrize(('name', 'arguments'), STARTS,
                         ids=[' '.join([name, *arguments]) for name, arguments in STARTS])
def test_signal_while_an_executable_starts_ends_it(name, arguments, folder):
    entry = ENTRIES[name]
    if name == 'tf_view':
        pytest.importorskip('viser')
    done = run(PROGRAM, str(PATIENCE_S / 10), entry, *(word.format(folder) for word in arguments))
    assert done.returncode == 0, done.stdout + done.stderr
    what, events, statuses = json.loads(done.stdout.splitlines()[-1])
    assert what == ('ended' if (name, arguments) == ENDS_BY_ITSELF else 'began'), done.stderr
    assert len(statuses) >= 40, f'only {events} events'
    assert set(statuses) == {0 if '.nodes.' in entry else 130}


# What the script of an entry point does, and a signal when the first large import begins.
SCRIPT = """
import os, signal, sys

def interrupt(event, arguments):
    if event == 'import' and arguments[0] == 'numpy':
        os.write(1, b'signalled')
        os.kill(os.getpid(), signal.SIGINT)

sys.addaudithook(interrupt)
sys.argv = sys.argv[1:]
from {} import {}
sys.exit({}())
"""


@pytest.mark.parametrize('name', sorted(ENTRIES))
def test_signal_at_the_first_large_import_ends_an_executable_quietly(name, folder):
    """Nothing handles signals before the package is imported, so that has to take no time."""
    if name == 'tf_view':
        pytest.importorskip('viser')
    module, _, function = ENTRIES[name].partition(':')
    [arguments, *_] = ARGUMENTS.get(name, [[]])
    done = run(SCRIPT.format(module, function, function), name,
               *(word.format(folder) for word in arguments))
    assert (done.stdout, done.stderr) == ('signalled', '')
    assert done.returncode == (0 if '.nodes.' in ENTRIES[name] else 130)
