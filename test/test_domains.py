# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tests, scripts and labs choose domains of their own, whose ports no other program is given."""

from contextlib import ExitStack
import os
from pathlib import Path
import socket
import subprocess
import sys

from domains import claim, is_safe, isolate, ports
from programs import PATIENCE_S
import pytest
from tf_tree_py.labs.live.live_session import DOMAINS, FIRST_DOMAIN, own_domain

SCRIPTS = Path(__file__).parents[1] / 'scripts'
RANGE = Path('/proc/sys/net/ipv4/ip_local_port_range')

# All processes try the same domain first, and hold theirs until their input closes.
CLAIM = """
import os
os.getpid = lambda: 7
import domains
domains.isolate()
print(os.environ['ROS_DOMAIN_ID'], flush=True)
input()
"""

needs_the_usual_range = pytest.mark.skipif(
    RANGE.exists() and RANGE.read_text().split() != ['32768', '60999'],
    reason="this machine's ephemeral ports are not those that Linux has by default")


def test_ports_are_those_of_the_standard():
    assert (ports(0)[0], ports(1)[0], ports(232)[0]) == (7400, 7650, 65400)


@needs_the_usual_range
def test_safe_domains_are_those_that_ros_recommends_for_linux():
    safe = [domain_id for domain_id in range(233) if is_safe(domain_id)]
    # Its page on ROS_DOMAIN_ID adds 101, of which only the first participants are safe.
    assert safe == [*range(101), *range(215, 233)]


def test_tests_run_in_a_safe_one():
    pytest.importorskip('rclpy')
    assert is_safe(int(os.environ['ROS_DOMAIN_ID']))


def test_one_more_is_another():
    isolate()
    own = int(os.environ['ROS_DOMAIN_ID'])
    more = claim()
    isolate()
    assert int(os.environ['ROS_DOMAIN_ID']) == own != more
    assert is_safe(more)


def test_two_processes_of_tests_never_share_one():
    processes = [subprocess.Popen(
        [sys.executable, '-c', CLAIM], cwd=Path(__file__).parent,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    claimed = [process.stdout.readline() for process in processes]
    for process in processes:
        process.communicate('\n', timeout=PATIENCE_S)
    assert all(claimed) and len(set(claimed)) == 3


def test_domain_of_a_program_that_runs_is_not_claimed():
    def claimed():
        done = subprocess.run([sys.executable, '-c', CLAIM], cwd=Path(__file__).parent,
                              input='\n', capture_output=True, text=True, timeout=PATIENCE_S,
                              check=True)
        return int(done.stdout)

    first = claimed()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(('127.0.0.1', ports(first)[10]))
        assert claimed() != first


@needs_the_usual_range
def test_scripts_choose_safe_ones():
    done = subprocess.run(
        ['bash', '-c', f'. {SCRIPTS}/lib.sh; for pid in {{1..1000}}; do domain_id_of $pid; done'],
        capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    chosen = {int(line) for line in done.stdout.split()}
    assert len(chosen) == 100 and all(is_safe(domain_id) for domain_id in chosen)


@needs_the_usual_range
def test_labs_choose_safe_ones():
    assert all(is_safe(domain_id) for domain_id in range(FIRST_DOMAIN, FIRST_DOMAIN + DOMAINS))


def test_two_labs_never_share_one_while_there_are_others():
    with ExitStack() as labs:
        own = [labs.enter_context(own_domain()) for _ in range(DOMAINS)]
        assert len(set(own)) == DOMAINS
        assert labs.enter_context(own_domain()) in own
    with own_domain() as first, own_domain() as second:
        assert first != second
