"""The other files of this folder are only collected where there is PyBullet."""

import pytest


def test_the_arm_is_tested_here():
    pytest.importorskip('pybullet', reason='the arm is tested in the venv of scripts/arm')
