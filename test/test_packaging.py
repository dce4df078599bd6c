from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import pytest

PACKAGE = distribution('tf_tree_py')
MANIFEST = ElementTree.parse(Path(__file__).parents[1] / 'package.xml')


def test_manifest_and_setup_name_one_version():
    assert PACKAGE.version == MANIFEST.findtext('version')


@pytest.mark.parametrize(
    'executable', PACKAGE.entry_points.select(group='console_scripts'), ids=lambda e: e.name)
def test_executable_has_a_main(executable):
    assert callable(executable.load())
