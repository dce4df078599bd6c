# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pages list every parameter of the nodes that blend an edge, like ``--help``."""

from pathlib import Path

import pytest
from tf_tree_py.nodes import edge_switch, relocalisation_anchor

DOCS = Path(__file__).parents[2] / 'docs'
PAGES = {'edge_switch': 'sources.md', 'relocalisation_anchor': 'corrections.md'}
SETTINGS = {
    'edge_switch': (
        edge_switch.SOURCES, *edge_switch.SETTINGS, *edge_switch.settings_of(['NAME'])),
    'relocalisation_anchor': relocalisation_anchor.SETTINGS,
}


def row(setting):
    default = setting.default
    shown = (str(default).lower() if isinstance(default, bool)
             else f'[{", ".join(default)}]' if isinstance(default, list) else f'{default}')
    return f'| `{setting.name}` | `{shown}` | {setting.meaning} |'


@pytest.mark.parametrize('node', SETTINGS)
def test_table_of_parameters_is_that_of_the_node(node):
    page = (DOCS / PAGES[node]).read_text()
    table = page.partition(f'| parameter of `{node}` | default | meaning |\n')[2]
    assert table, 'the page has no such table'
    rows = table.partition('\n\n')[0].splitlines()[1:]
    assert rows == list(map(row, SETTINGS[node]))
