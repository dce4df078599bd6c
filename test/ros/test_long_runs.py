# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The benchmark of long and large trees: its attacks, its judgement, and a short run of each."""

from itertools import islice
import os
from pathlib import Path
import sys
import time

from benchmark import motion
from benchmark.processes.hostile_publisher import ATTACKS
from benchmark.processes.tick_looker import GUARDED, TICK, TickLooker
from benchmark.resources import cpu_s_of, levels_off, MB, Use, use_of
from programs import completed
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import WireReader, write

CHAIN = motion.chain(5).edges
ROOT, LEAF = CHAIN[0].parent, CHAIN[-1].child


def honest(stamp):
    return [Sample(edge.parent, edge.child, stamp, motion.steady_pose(stamp)) for edge in CHAIN]


@pytest.mark.parametrize('attack', ATTACKS)
def test_honest_chain_is_right_beside_an_attack(attack):
    buffer, reader = BufferCore(now=time.time_ns, max_future=10**9), WireReader()
    first = time.time_ns()
    for number, hostile in enumerate(islice(ATTACKS[attack][0](ROOT, LEAF), 3)):
        for samples in (honest(first + number * TICK), hostile):
            buffer.insert_batch(reader.read(write(samples)), 'somebody')
        for edge in CHAIN:
            stamp = first + number * TICK
            assert buffer.lookup(edge.parent, edge.child, stamp).x == pytest.approx(
                motion.steady_pose(stamp)[0], abs=1e-9)
    counted = buffer.statistics()
    assert counted.refused if attack != 'crowds' else counted.frames == 20_000
    assert counted.accepted > 3 * len(CHAIN) or attack == 'names'


def test_wrong_answers_are_counted_and_missing_ones_are_not(node):
    looker = TickLooker(GUARDED, node)
    first = time.time_ns() // TICK
    assert looker.wrong(first, 10, len(CHAIN)) == 0, 'there are no answers'
    # Far apart, so that nearly all answers are interpolated.
    for tick in (first, first + 9):
        looker.buffer.insert_many(honest(tick * TICK))
    assert looker.wrong(first, 10, len(CHAIN)) == 0
    assert looker.run(first - 2, 4, ROOT, LEAF)['missed'] == [first - 2, first - 1]
    edge, stamp = CHAIN[2], (first + 10) * TICK
    looker.buffer.insert(edge.parent, edge.child, stamp, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    assert looker.wrong(first, 11, len(CHAIN)) == 1
    looker.listener.close()


@pytest.mark.parametrize(('last', 'level'), [
    (Use(110 * MB, 12, 12), True), (Use(90 * MB, 5, 5), True), (Use(120 * MB, 10, 10), False),
    (Use(100 * MB, 14, 10), False), (Use(100 * MB, 10, 14), False)])
def test_growth_in_the_last_third_is_found(last, level, capsys):
    before = [Use(10 * MB, 1, 1)] * 3 + [Use(100 * MB, 10, 10)] * 3
    assert levels_off('it', [*before, Use(100 * MB, 10, 10), Use(1, 1, 1), last]) == level
    assert capsys.readouterr().out.endswith('level\n' if level else 'it grows\n')


def test_use_of_a_process_is_what_the_system_counts():
    before = use_of(os.getpid())
    with open(os.devnull):
        after = use_of(os.getpid())
    assert after.descriptors == before.descriptors + 1
    assert after.threads >= 1
    assert after.memory > 10 * MB
    assert cpu_s_of(os.getpid()) > 0.0


@pytest.mark.parametrize(('scenario', 'lines'), [
    ('long', ('tf_tree_py 2: ', 'lookups without an answer')),
    ('hostile', ('of 300 missed, 0 wrong', 'lookups without an answer'))])
def test_short_run_tells_how_it_went(scenario, lines):
    ended = completed(sys.executable, '-m', 'benchmark.long_runs', scenario, '--minutes', '0.05',
                      cwd=Path(__file__).parents[2])
    for line in (*lines, 'load average: before '):
        assert line in ended.stdout, ended.stderr
