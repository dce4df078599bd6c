# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Comparison with KinHEC's sequences with known ground truth, and its reference solvers.

An ordinary run uses some sequences. The thorough profile of hypothesis uses whole tracks: ten
sequences of the noise track have none of the worst camera in continuous motion.
"""

from hypothesis import settings
import pytest

THOROUGH = settings().max_examples >= 200


@pytest.fixture(scope='module')
def kinhec():
    """Return the peer, whose import takes seconds: only the process that runs the tests pays."""
    pytest.importorskip('kinhec', reason='kinhec is not installed: pip install kinhec')
    from benchmark.peers import kinhec_tracks
    return kinhec_tracks


@pytest.mark.skipif(not THOROUGH, reason='whole tracks take minutes: '
                    '--hypothesis-profile thorough')
@pytest.mark.parametrize('track', ['noise', 'motion', 'temporal', 'outliers'])
def test_no_worse_than_the_reference_on_each_track(kinhec, track):
    found = [(kinhec.ours(sequence, time=track == 'temporal'), kinhec.reference(sequence))
             for sequence in kinhec.sequences(track)]
    for statistic in kinhec.STATISTICS:
        ours, theirs = (kinhec.over(each, statistic) for each in zip(*found, strict=True))
        assert ours.turned_deg <= theirs.turned_deg, statistic
        assert ours.moved_mm <= theirs.moved_mm, statistic


def test_late_and_jittering_stamps(kinhec):
    mean = kinhec.mean([kinhec.ours(sequence, time=True)
                        for sequence in kinhec.late_and_jittering(6 if THOROUGH else 2)])
    assert mean.late_ms < 1.5 and mean.turned_deg < 0.2 and mean.moved_mm < 8.0


def test_outliers_of_others(kinhec):
    mean = kinhec.mean([kinhec.ours(sequence)
                        for sequence in kinhec.with_outliers(8 if THOROUGH else 2)])
    assert mean.turned_deg < 0.5 and mean.moved_mm < 5.0
