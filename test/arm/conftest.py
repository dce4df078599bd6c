"""The arm is simulated by PyBullet: without it there is nothing to test here."""

from importlib.util import find_spec

if find_spec('pybullet') is None:
    collect_ignore_glob = ['test_arm_*.py']
