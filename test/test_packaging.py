from importlib.metadata import distribution
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree
import zipfile

from programs import PATIENCE_S
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


@pytest.fixture(scope='module')
def wheel(tmp_path_factory):
    """Return what pip makes of a copy of the sources, in which an earlier build lies about."""
    pytest.importorskip('pip')
    source = tmp_path_factory.mktemp('wheel') / 'source'
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
         '--disable-pip-version-check', '--wheel-dir', source.parent, source],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr
    [wheel] = source.parent.glob('*.whl')
    return set(zipfile.ZipFile(wheel).namelist())


def test_wheel_has_the_modules_that_are_there_and_no_deleted_ones(wheel):
    there = {path.relative_to(REPOSITORY).as_posix()
             for path in REPOSITORY.glob('tf_tree_py/**/*.py')}
    assert {name for name in wheel
            if name.startswith('tf_tree_py/') and name.endswith('.py')} == there


def test_wheel_says_that_it_has_types(wheel):
    assert 'tf_tree_py/py.typed' in wheel
