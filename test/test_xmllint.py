# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import pytest


@pytest.mark.linter
@pytest.mark.xmllint
def test_xmllint():
    ament_xmllint = pytest.importorskip('ament_xmllint.main')
    assert ament_xmllint.main(argv=['.']) == 0, 'Found XML that does not follow its schema'
