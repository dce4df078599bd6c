# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page lists every parameter of the nodes that blend an edge, like ``--help``."""

from pathlib import Path

import pytest
from tf_tree_py.nodes import edge_switch, relocalisation_anchor

PAGE = Path(__file__).parents[2] / 'docs' / 'beyond_tf2.md'
SETTINGS = {
    'edge_switch': (
        edge_switch.SOURCES, *edge_switch.SETTINGS, *edge_switch._settings_of(['NAME'])),
    'relocalisation_anchor': relocalisation_anchor.SETTINGS,
}


def row(setting):
    default = setting.default
    shown = (str(default).lower() if isinstance(default, bool)
             else f'[{", ".join(default)}]' if isinstance(default, list) else f'{default}')
    return f'| `{setting.name}` | `{shown}` | {setting.meaning} |'


@pytest.mark.parametrize('node', SETTINGS)
def test_table_of_parameters_is_that_of_the_node(node):
    table = PAGE.read_text().partition(f'| parameter of `{node}` | default | meaning |\n')[2]
    assert table, 'the page has no such table'
    rows = table.partition('\n\n')[0].splitlines()[1:]
    assert rows == list(map(row, SETTINGS[node]))
