from importlib.metadata import distribution
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree
import zipfile

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = distribution('tf_tree_py')
MANIFEST = ElementTree.parse(REPOSITORY / 'package.xml')


def test_manifest_and_setup_name_one_version():
    assert PACKAGE.version == MANIFEST.findtext('version')


@pytest.mark.parametrize(
    'executable', PACKAGE.entry_points.select(group='console_scripts'), ids=lambda e: e.name)
def test_executable_has_a_main(executable):
    assert callable(executable.load())


def test_wheel_has_the_modules_that_are_there_and_no_deleted_ones(tmp_path):
    pytest.importorskip('pip')
    source = tmp_path / 'source'
    source.mkdir()
    for name in ('setup.py', 'setup.cfg', 'pyproject.toml', 'package.xml'):
        shutil.copy(REPOSITORY / name, source)
    for name in ('tf_tree_py', 'resource', 'config', 'launch', 'rviz'):
        shutil.copytree(REPOSITORY / name, source / name,
                        ignore=shutil.ignore_patterns('__pycache__'))
    left = source / 'build' / 'lib' / 'tf_tree_py' / 'core' / 'deleted.py'
    left.parent.mkdir(parents=True)
    left.touch()
    done = subprocess.run(
        [sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation',
         '--disable-pip-version-check', '--wheel-dir', tmp_path, source],
        capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    [wheel] = tmp_path.glob('*.whl')
    modules = {name for name in zipfile.ZipFile(wheel).namelist() if name.endswith('.py')}
    there = {path.relative_to(source).as_posix() for path in source.glob('tf_tree_py/**/*.py')}
    assert {name for name in modules if name.startswith('tf_tree_py/')} == there
