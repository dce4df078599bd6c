# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A doctor that gathers messages returns what one does that processes each on arrival."""

from dataclasses import asdict
from types import SimpleNamespace

from counting import calls
from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import invariant, precondition, rule, RuleBasedStateMachine
import numpy as np
import pytest
from tf_tree_py.core import Kind
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.sample_rows import MessageColumns

MS = 1_000_000
LAYOUTS = [
    [('map', 'odom'), ('odom', 'base'), ('base', 'arm')],
    [('odom', 'base')],
    [('map', 'base'), ('base', 'arm')],
    [('base', 'arm'), ('odom', 'base')],
    [],
]
# Each listener has objects of its own for the edges of its layouts.
SHARED = [tuple(layout) for layout in LAYOUTS]
SAMPLES = st.tuples(
    # Milliseconds of the stamp after the arrival; None: the stamp is zero.
    st.sampled_from([0, 0, 0, 0, -5, 20, -5000, None]),
    st.sampled_from([0.0, 0.0, 0.01, 3.0, np.nan]))


class PromptDoctor(Doctor):
    """Processes each message on arrival."""

    def received(self, arrival):
        super().received(arrival)
        with self._lock:
            self._digest()


def case_of(doctor):
    """Return everything that a doctor has measured."""
    cases = []
    doctor.findings(checks=[SimpleNamespace(findings=lambda case: cases.append(case) or ())])
    return cases[0]


def facts(case):
    """Return what was measured, other than of the clocks' steps."""
    return {edge.frames: (set(edge.authorities), moving(edge.moving), fixed(edge.fixed))
            for edge in case.edges}


def moving(edge):
    if edge is None:
        return None
    timing, motion = edge.timing, edge.motion
    # Speeds are measured from the block of the first motion on.
    spreads = [timing.delays, timing.intervals, timing.waits, motion.turns.sizes]
    return [
        [getattr(timing, name) for name in (
            'count', 'zeros', 'first', 'last', 'duplicates', 'differing', 'disorders', 'jumps',
            'back', 'longest', 'longest_wait', 'interval', 'whole_seconds', 'frozen')],
        [getattr(motion, name) for name in (
            'moved', 'planar', 'tilt', 'travelled', 'off_length', 'worst_length', 'steps')],
        [asdict(jump) for jump in (motion.fast, motion.slow, motion.outliers, motion.lone)],
        [(spread.count, spread.least, spread.most, spread.at(0.05, 0.5, 0.95))
         for spread in spreads],
        motion.turns.intervals, timing.pairs.kept.tolist(), list(edge.beside)]


def fixed(edge):
    return None if edge is None else (edge.count, edge.first, edge.changes, edge.gone, edge.turned)


def parents(case):
    return {child: (one.switches, one.last) for child, one in case.parents.items()}


class Gathering(RuleBasedStateMachine):
    """Two doctors receive the same; one of them is read from time to time."""

    def __init__(self):
        super().__init__()
        self.doctors = Doctor(), PromptDoctor()
        self.now = 10**18
        self.place = 0.0

    @rule(layout=st.sampled_from(range(len(LAYOUTS))), shared=st.booleans(),
          topic=st.sampled_from(['/tf', '/tf', '/tf', '/other', '']),
          static=st.sampled_from([False] * 5 + [True]),
          clock=st.sampled_from([True] * 9 + [False]),
          authority=st.sampled_from(['', 'a', 'b']), samples=st.lists(SAMPLES, min_size=1))
    def receive(self, layout, shared, topic, static, clock, authority, samples):
        # Lists whose ids other lists may get: nothing else refers to them.
        edges = SHARED[layout] if shared else list(LAYOUTS[layout])
        for late, step in samples:
            self.now += 20 * MS
            self.place = step + (0.0 if np.isnan(self.place) else self.place)
            stamp = 0 if late is None else self.now + late * MS
            pose = pack_pose(self.place, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            for doctor in self.doctors:
                doctor.received(ReceivedMessage(
                    Batch(edges, [stamp] * len(edges), [pose] * len(edges)),
                    self.now if clock else 0, topic, static, authority))

    @rule(edge=st.sampled_from(LAYOUTS[0]), kind=st.sampled_from([Kind.OLD_DATA, Kind.LOOP]))
    def refuse(self, edge, kind):
        for doctor in self.doctors:
            doctor.saw_incidents([Incident(kind, *edge, self.now, 'a', 'why')])

    @rule(seconds=st.sampled_from([-100, 100]))
    def clock_jumps(self, seconds):
        self.now += seconds * 1000 * MS

    @precondition(lambda self: self.doctors[0].transforms)
    @rule()
    def read_symptoms(self):
        one, other = ([{**sign.as_dict(), 'publishers': {*sign.publishers}}
                       for sign in doctor.signs()] for doctor in self.doctors)
        assert one == other

    @rule()
    def read_findings(self):
        # They also depend on the clocks' steps, which are compared with the rest of a block.
        self.doctors[0].findings()

    @rule()
    def pop_recent(self):
        one, other = (doctor.pop_recent() for doctor in self.doctors)
        assert one.keys() == other.keys()
        for edge, recent in one.items():
            mean = pytest.approx(other[edge].mean_delay, rel=1e-12)
            assert asdict(recent) == {**asdict(other[edge]), 'mean_delay': mean}

    @invariant()
    def every_arrival_is_counted(self):
        assert len({(doctor.transforms, doctor.watched) for doctor in self.doctors}) == 1

    def teardown(self):
        self.read_symptoms()
        one, other = map(case_of, self.doctors)
        assert facts(one) == facts(other)
        assert parents(one) == parents(other)


Gathering.TestCase.settings = examples(2, stateful_step_count=30)
TestGathering = Gathering.TestCase


def test_layouts_that_a_program_invents_do_not_eat_the_memory():
    doctor, number = Doctor(), 0
    pose = pack_pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    with calls() as of:
        while not of(MessageColumns.pop):
            edges = [('map', f'child{number}'), ('map', f'other{number}')]
            doctor.received(ReceivedMessage(Batch(edges, [1, 1], [pose, pose]), 1, '/tf'))
            number += 1
            assert number < 5_000
