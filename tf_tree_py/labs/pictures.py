# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Drawing with matplotlib: readable in black and white, the same bytes every time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

INSTALL = 'No picture: that needs matplotlib, pip install "tf_tree_py[plot]"'

# Colours are not the only difference: the lines and markers differ too.
STYLES: tuple[dict[str, Any], ...] = (
    {'color': '#000000', 'linestyle': '-', 'marker': 'o'},
    {'color': '#0060a8', 'linestyle': '--', 'marker': 's'},
    {'color': '#c84c00', 'linestyle': '-.', 'marker': '^'},
    {'color': '#007a5a', 'linestyle': ':', 'marker': 'D'},
)
GREY = '#767676'

_DPI = 110

_SETTINGS = {
    'font.family': 'DejaVu Sans',
    'font.size': 9.0,
    'axes.titlesize': 9.5,
    'axes.grid': True,
    'axes.axisbelow': True,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'grid.color': '#dcdcdc',
    'lines.linewidth': 1.5,
    'lines.markersize': 4.5,
    'legend.frameon': True,
    'legend.framealpha': 0.9,
    'legend.handlelength': 3.2,
    # So that the same numbers give the same file.
    'svg.hashsalt': 'tf_tree_py',
    'svg.fonttype': 'path',
}


class NoPicture(Exception):
    """The picture cannot be drawn or written; the text says why."""


def save(draw: Callable[[Any], None], folder: Path, name: str) -> list[Path]:
    """
    Draw a picture and write it as PNG and SVG.

    :param draw: draws into a matplotlib ``Figure``.
    :return: the files.
    :raises NoPicture: matplotlib is missing, or the folder cannot be written.
    """
    try:
        from matplotlib import rc_context
    except ImportError:
        raise NoPicture(INSTALL) from None
    paths = [folder / f'{name}.png', folder / f'{name}.svg']
    figure = figure_of(draw)
    with rc_context(_SETTINGS):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            figure.savefig(paths[0], dpi=_DPI, metadata={'Software': None})
            figure.savefig(paths[1], metadata={'Date': None, 'Creator': None})
        except OSError as error:
            raise NoPicture(f'No picture: {error}') from error
    return paths


def figure_of(draw: Callable[[Any], None]) -> Any:
    """
    Return the matplotlib ``Figure`` of a picture.

    :raises ImportError: matplotlib is missing.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    with rc_context(_SETTINGS):
        figure = Figure(figsize=(8.0, 4.2), dpi=_DPI, layout='constrained')
        draw(figure)
    return figure
