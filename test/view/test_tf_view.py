# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_view: its arguments, its addresses, its end, live and recorded."""

from contextlib import closing
import os
import re
import signal
import socket
import sys

from bags import Message, SECOND, write_ros2
import numpy as np
from open_page import OpenPage
from programs import completed, executable
import pytest

pytest.importorskip('viser', reason='pages need viser')

COMMAND = (sys.executable, '-m', 'tf_tree_py.view.tf_view')
SAID = 'is shown at'
# Ports that no other test process uses, even of a second run on this machine, like its DDS domain.
PORT = 18700 + 10 * int(os.environ.get('ROS_DOMAIN_ID', 0))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    pose = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return write_ros2(tmp_path_factory.mktemp('bags') / 'drive', [
        Message(stamp, '/tf', [('map', 'base', stamp, pose)])
        for stamp in range(SECOND, 3 * SECOND, SECOND // 10)])


def address(program):
    program.wait_for(SAID)
    return re.search(r'http://\S+', program.output)[0]


def listening(port):
    """Return the addresses of this machine with an open port, in the kernel's format."""
    found = set()
    for table in ('/proc/net/tcp', '/proc/net/tcp6'):
        with open(table) as file:
            for line in list(file)[1:]:
                _, local, _, state, *_ = line.split()
                where, _, number = local.partition(':')
                if state == '0A' and int(number, 16) == port:
                    found.add(where)
    return found


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['--port', '0'], '0 is not a number from 1 to 65535'),
    (['--port', 'x'], "invalid int value: 'x'"),
    (['--nonsense'], 'unrecognized arguments: --nonsense'),
    (['--host', '203.0.113.7'], 'cannot listen on 203.0.113.7'),
    (['--host', 'no such host'], 'cannot listen on no such host'),
    (['--urdf', 'nowhere.urdf'], 'nowhere.urdf'),
    (['--urdf', __file__], 'test_tf_view.py'),
    (['--bag', 'nowhere.mcap'], 'there is no such file'),
    (['--bag', __file__], 'is not a bag'),
    (['--ros-args', '--nonsense'], 'unknown ROS arguments'),
])
def test_mistake_gets_one_sentence(arguments, sentence):
    done = completed(*COMMAND, *arguments)
    assert done.returncode == 2, done.stdout
    assert sentence in done.stderr
    assert done.stderr.count('\n') == 1 and done.stdout == ''


def test_port_that_is_taken_gets_one_sentence(bag):
    with closing(socket.create_server(('127.0.0.1', 0))) as taken:
        port = taken.getsockname()[1]
        done = completed(*COMMAND, '--bag', bag, '--port', str(port))
    assert done.returncode == 2
    assert f'cannot listen on 127.0.0.1:{port}: ' in done.stderr


def test_without_viser_it_says_what_to_install(bag):
    program = ("import sys; sys.modules['viser'] = None; "
               'from tf_tree_py.view.tf_view import main; '
               f'sys.exit(main(["tf_view", "--bag", {str(bag)!r}]))')
    done = completed(sys.executable, '-c', program)
    assert done.returncode == 2
    assert 'pip install viser' in done.stderr and done.stderr.count('\n') == 1


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_it_listens_on_this_machine_only_and_ends_in_order(start_program, bag, number):
    program = start_program(*COMMAND, '--bag', str(bag), '--port', str(PORT))
    assert address(program) == f'http://127.0.0.1:{PORT}'
    assert listening(PORT) == {'0100007F'}
    program.interrupt(number)
    program.interrupt(signal.SIGTERM)  # a second signal of an impatient user
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_slider_spans_the_recording(start_program, bag, window):
    page = OpenPage(window, address(start_program(*COMMAND, '--bag', str(bag))))
    page.wait_for_text('paused at 1.0')
    page.go_to(1.5)
    page.wait_for_text('paused at 2.5')
    assert page.page.get_by_role('button', name='live', exact=True).count() == 0
    assert not page.complaints


def test_five_frames_of_a_live_robot_are_seen(start_program, window):
    start_program(*executable('five_frame_publisher'))
    page = OpenPage(window, address(start_program(*COMMAND, '--fixed-frame', 'odom')))
    page.wait_for_text('5 frames')
    page.wait_for_axes(lambda position, scale, _: len(scale) == 5 and (scale > 0.0).all()
                       and np.allclose(position[0], 0.0))
    page.choose('gripper')
    page.turn_to('chosen')
    page.page.locator('.tf-facts', has_text='/five_frame_publisher').wait_for()
    assert not page.complaints


def test_red_bar_shows_that_the_server_is_gone_until_it_is_back(start_program, bag, window):
    command = (*COMMAND, '--bag', str(bag), '--port', str(PORT + 1))
    program = start_program(*command)
    page = OpenPage(window, address(program))
    bar = page.page.locator('#tf-silent')
    bar.wait_for(state='detached')
    program.kill()
    bar.filter(has_text='The server does not answer.').wait_for()
    assert page.page.locator('.tf-status').is_visible()
    address(start_program(*command))
    page.page.bring_to_front()
    bar.wait_for(state='detached')
    page.wait_for_text('paused at 1.0')


def test_red_bar_shows_that_the_server_hangs(start_program, bag, window):
    program = start_program(*COMMAND, '--bag', str(bag), '--port', str(PORT + 2))
    page = OpenPage(window, address(program))
    bar = page.page.locator('#tf-silent')
    program.interrupt(signal.SIGSTOP)
    bar.filter(has_text='The server does not answer.').wait_for()
    program.interrupt(signal.SIGCONT)
    bar.wait_for(state='detached')
    page.page.close()
