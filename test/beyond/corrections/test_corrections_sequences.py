# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sequences of ``test_corrections_model`` that broke a guarantee once, the shortest of a kind."""

from inputs import for_each
from test_corrections_model import CorrectedEdge, LIMITS, POINTS
from tf_tree_py.core import Pose

FAR = Pose.from_xyz_rpy(x=0.8, y=-0.8, yaw=0.5)
NEAR = Pose.from_xyz_rpy(x=0.1, yaw=-0.3)
GUARANTEES = ['no_answer_changes', 'nothing_is_faster_than_stated', 'all_lookups_agree',
              'without_a_correction_samples_are_as_they_came']


class Played:
    """The state machine, with steps that are written down; each checks all guarantees."""

    def __init__(self, turns, sources=False):
        self.edge = CorrectedEdge()
        self.begin(turns=turns, sources=sources, jumps=False)

    def __getattr__(self, step):
        def checked(**options):
            getattr(self.edge, step)(**options)
            for guarantee in GUARANTEES:
                getattr(self.edge, guarantee)()

        return checked

    def correct_slowly(self, limits, about):
        """Begin a blend that lasts, and drive on while it does."""
        self.change_limits(limits=limits, about=about)
        self.correct_once(goal=FAR)
        self.drive(count=12)


@for_each(turns=[0.0, 2.0], every=[1, 3], noise=[0.001, 0.01])
def test_lower_limits_while_corrections_keep_coming(turns, every, noise):
    edge = Played(turns)
    edge.correct_slowly(LIMITS[0], POINTS[0])
    edge.change_limits(limits=LIMITS[3], about=POINTS[1])
    edge.correct_often(goal=NEAR, every=every, noise=noise, seed=73)


@for_each(opposite=[False, True])
def test_one_that_is_sent_again_to_a_parent_that_comes_back(opposite):
    edge = Played(turns=0.0)
    edge.correct_slowly(LIMITS[3], POINTS[0])
    edge.change_parent()
    edge.change_limits(limits=LIMITS[2], about=POINTS[1])
    edge.change_parent()
    edge.correct_again(opposite=False)  # with the limits of the other parent: it is new
    edge.drive(count=12)
    edge.correct_again(opposite=opposite)


@for_each(turns=[0.0, 2.0])
def test_limits_and_point_of_another_parent_do_not_apply_to_this_one(turns):
    edge = Played(turns)
    edge.correct_slowly(LIMITS[3], POINTS[0])
    edge.change_parent()
    edge.change_limits(limits=LIMITS[4], about=POINTS[1])
    edge.change_parent()
    edge.drive(count=100)
    edge.wait()


@for_each(about=POINTS, limits=LIMITS[:4])
def test_switches_during_a_blend_about_any_point(about, limits):
    edge = Played(turns=2.0, sources=True)
    edge.correct_slowly(limits, about)
    for _ in range(2):
        edge.switch()
        edge.drive(count=12)
    edge.correct_again(opposite=True)
    edge.wait()
