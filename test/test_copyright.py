import pytest


@pytest.mark.copyright
@pytest.mark.linter
def test_copyright():
    ament_copyright = pytest.importorskip('ament_copyright.main')
    assert ament_copyright.main(argv=['.']) == 0, 'Found files without copyright and licence'
