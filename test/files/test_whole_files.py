# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files that are written whole or not at all: together, through links, with modes, into pipes."""

from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path
import stat
import subprocess
import sys
from tempfile import TemporaryDirectory

import pytest
from tf_tree_py import BufferCore, load, Pose
from tf_tree_py.files.whole_files import write_whole


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_file_is_new_or_replaced_and_nothing_else_remains(tmp_path):
    path = tmp_path / 'x'
    for text in (b'old', b'new'):
        write_whole(path, [text, b' ', memoryview(text)])
        assert path.read_bytes() == text + b' ' + text
        assert names(tmp_path) == ['x']


def test_writers_and_readers_of_one_path_see_whole_files(tmp_path):
    def snapshot(frames):
        buffer = BufferCore()
        for number in range(frames):
            buffer.insert('map', f'frame {number}', 0, Pose(x=number), static=True)
        return buffer.snapshot()

    def write(snapshot):
        for _ in range(60):
            snapshot.save(path)

    def read():
        for _ in range(60):
            tree = load(path, verify=True)
            seen.add(len(tree.frames()))

    path, trees, seen = tmp_path / 'tree', [snapshot(frames) for frames in (2, 90)], set()
    trees[0].save(path)
    with ThreadPoolExecutor(4) as pool:
        jobs = [pool.submit(write, tree) for tree in trees] + [pool.submit(read) for _ in range(2)]
        for job in jobs:
            job.result()
    assert seen <= {3, 91}
    assert names(tmp_path) == ['tree']


def test_tree_that_is_mapped_stays_what_it_was_when_it_is_written_again(tmp_path):
    buffer, path = BufferCore(), tmp_path / 'tree'
    buffer.insert('map', 'base', 1, Pose(x=1.0))
    buffer.snapshot().save(path)
    mapped = load(path)
    for _ in range(3):
        buffer.clear()
        buffer.insert('map', 'base', 1, Pose(x=2.0))
        buffer.snapshot().save(path)
    assert mapped.lookup('map', 'base', 1) == Pose(x=1.0)
    assert load(path).lookup('map', 'base', 1) == Pose(x=2.0)


def test_symbolic_link_stays_and_its_file_is_replaced(tmp_path):
    """The layout of ``colcon build --symlink-install``."""
    (tmp_path / 'src').mkdir()
    (tmp_path / 'install').mkdir()
    source, link = tmp_path / 'src' / 'robot.urdf', tmp_path / 'install' / 'robot.urdf'
    source.write_bytes(b'old')
    link.symlink_to(os.path.join('..', 'src', 'robot.urdf'))
    write_whole(link, [b'new'])
    assert link.is_symlink() and source.read_bytes() == b'new' and not source.is_symlink()
    assert names(tmp_path / 'src') == names(tmp_path / 'install') == ['robot.urdf']
    source.unlink()
    write_whole(link, [b'again'])
    assert source.read_bytes() == b'again'


@pytest.mark.parametrize('mode', [0o600, 0o664, 0o755, 0o444])
def test_mode_of_an_existing_file_stays(tmp_path, mode):
    path = tmp_path / 'x'
    path.write_bytes(b'old')
    path.chmod(mode)
    write_whole(path, [b'new'])
    assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_bytes() == b'new'


def test_private_file_is_private_while_it_is_written(tmp_path):
    path = tmp_path / 'x'
    path.write_bytes(b'old')
    path.chmod(0o600)

    def parts():
        unfinished, = set(tmp_path.iterdir()) - {path}
        yield oct(stat.S_IMODE(unfinished.stat().st_mode)).encode()

    write_whole(path, parts())
    assert path.read_bytes() == b'0o600'


def test_new_file_has_the_mode_of_any_new_file(tmp_path):
    (tmp_path / 'usual').write_bytes(b'')
    write_whole(tmp_path / 'x', [b''])
    assert (tmp_path / 'x').stat().st_mode == (tmp_path / 'usual').stat().st_mode


def test_pipe_is_written_in_place(tmp_path):
    path = tmp_path / 'pipe'
    os.mkfifo(path)
    handle = os.open(path, os.O_RDWR | os.O_NONBLOCK)
    write_whole(path, [b'one ', b'two'])
    with open(handle, 'rb', buffering=0) as pipe:
        assert pipe.read(100) == b'one two'
    assert path.is_fifo()


WRITES = """
import sys
from pathlib import Path
from tf_tree_py.files.whole_files import write_whole
print('before', flush=True)
write_whole(Path(sys.argv[1]), [b'data'])
print('after')
"""


@pytest.mark.parametrize('name', ['link', '/dev/fd/1', '/proc/self/fd/1'])
def test_standard_output_is_written_in_place_even_if_it_is_a_file(tmp_path, name):
    # Not /dev/stdout itself, which a fault could replace.
    (tmp_path / 'link').symlink_to('/dev/stdout')
    command = [sys.executable, '-c', WRITES, tmp_path / name]
    piped = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    assert piped.stdout == b'before\ndataafter\n'
    with (tmp_path / 'log').open('ab') as log:
        subprocess.run(command, stdout=log, check=True)
    assert (tmp_path / 'log').read_bytes() == b'before\ndataafter\n'


@pytest.mark.skipif(not os.access('/dev/shm', os.W_OK),
                    reason='/dev/shm does not exist or cannot be written')
def test_file_in_shared_memory_is_replaced_as_any_other():
    with TemporaryDirectory(dir='/dev/shm') as folder:
        for text in (b'old', b'new'):
            write_whole(Path(folder, 'x'), [text])
            assert Path(folder, 'x').read_bytes() == text


def test_link_that_waits_at_the_name_of_an_earlier_temporary_file_is_not_followed(tmp_path):
    victim = tmp_path / 'victim'
    victim.write_bytes(b'safe')
    (tmp_path / f'.x.{os.getpid()}.unfinished').symlink_to(victim)
    write_whole(tmp_path / 'x', [b'new'])
    assert victim.read_bytes() == b'safe'


@pytest.mark.parametrize('name', ['x' * 255, '\N{ROBOT FACE}' * 60])
def test_longest_name_can_be_written(tmp_path, name):
    path = tmp_path / name
    write_whole(path, [b'new'])
    assert path.read_bytes() == b'new'


def test_error_of_what_makes_the_parts_keeps_its_text(tmp_path):
    def parts():
        yield b'new'
        raise OSError('cannot seek')

    with pytest.raises(OSError, match='^cannot seek$'):
        write_whole(tmp_path / 'x', parts())
    assert not names(tmp_path)


OF_A_MEMBER = """
import os, sys
from pathlib import Path
from tf_tree_py.files.whole_files import write_whole
os.setgroups([1234])
os.setgid(1000)
os.setuid(1000)
write_whole(Path(sys.argv[1]), [b'new'])
"""


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can become another user')
def test_group_stays_where_the_owner_cannot():
    with TemporaryDirectory(dir='/tmp') as folder:
        path = Path(folder, 'x')
        path.write_bytes(b'old')
        os.chown(path, 0, 1234)
        path.chmod(0o660)
        Path(folder).chmod(0o777)
        subprocess.run([sys.executable, '-c', OF_A_MEMBER, path], check=True)
        found = path.stat()
        assert path.read_bytes() == b'new'
        assert (found.st_uid, found.st_gid, stat.S_IMODE(found.st_mode)) == (1000, 1234, 0o660)


FULL = """
import resource, signal, sys
from pathlib import Path
from tf_tree_py.files.whole_files import write_whole
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    write_whole(Path(sys.argv[1]), [b'x' * 600] * 3)
except OSError as error:
    print(error.strerror, Path(error.filename).name)
"""


def test_disk_that_is_full_leaves_the_old_file_and_no_other(tmp_path):
    (tmp_path / 'x').write_bytes(b'old')
    done = subprocess.run([sys.executable, '-c', FULL, tmp_path / 'x'], text=True,
                          stdout=subprocess.PIPE, check=True)
    assert done.stdout == 'File too large x\n'
    assert (tmp_path / 'x').read_bytes() == b'old' and names(tmp_path) == ['x']


def test_parts_that_raise_leave_the_old_file_and_no_other(tmp_path):
    def parts():
        yield b'half'
        raise ZeroDivisionError

    (tmp_path / 'x').write_bytes(b'old')
    with pytest.raises(ZeroDivisionError):
        write_whole(tmp_path / 'x', parts())
    assert (tmp_path / 'x').read_bytes() == b'old' and names(tmp_path) == ['x']


@pytest.mark.parametrize('name', ['no/x', '.'])
def test_what_cannot_be_written_is_an_error_of_the_system(tmp_path, name):
    with pytest.raises(OSError, match='No such file|Is a directory') as caught:
        write_whole(tmp_path / name, [b''])
    assert caught.value.filename == str(tmp_path / name)
