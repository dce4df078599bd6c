# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Drawing with matplotlib: readable in black and white, with reproducible bytes."""

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, TYPE_CHECKING

from tf_tree_py.files.whole_files import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:  # a lab without its picture needs no matplotlib
    Axes = Figure = object

INSTALL = 'No picture: drawing requires matplotlib (pip install matplotlib)'

# Not only the colours differ: the lines and markers differ too.
STYLES: tuple[dict[str, Any], ...] = (
    {'color': '#000000', 'linestyle': '-', 'marker': 'o'},
    {'color': '#0060a8', 'linestyle': '--', 'marker': 's'},
    {'color': '#c84c00', 'linestyle': '-.', 'marker': '^'},
    {'color': '#007a5a', 'linestyle': ':', 'marker': 'D'},
)
GREY = '#767676'

_DPI = 110

_SETTINGS: dict[Any, Any] = {
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
    # Makes the same numbers give the same file.
    'svg.hashsalt': 'tf_tree_py',
    'svg.fonttype': 'path',
}


def note(axes: Axes, text: str, point: Any, offset: tuple[float, float], **options: Any) -> None:
    """
    Write a text beside a point.

    :param offset: of the text from the point, right and up, 1/72 inch.
    :param options: passed to ``Axes.annotate``.
    """
    axes.annotate(text, point, offset, textcoords='offset points', **options)


def name_ticks(axes: Axes, values: Sequence[float]) -> None:
    """Mark just these values on the x axis, which may be logarithmic."""
    axes.set_xticks(values, [f'{value:g}' for value in values])
    axes.minorticks_off()


class NoPicture(Exception):
    """The picture cannot be drawn or written; the text says why."""


def save(draw: Callable[[Figure], None], folder: Path, name: str) -> list[Path]:
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
            _write(figure, paths[0], dpi=_DPI, metadata={'Software': None})
            _write(figure, paths[1], metadata={'Date': None, 'Creator': None})
        except OSError as error:
            raise NoPicture(f'No picture: {error.filename}: {error.strerror}') from error
    return paths


def _write(figure: Figure, path: Path, **options: Any) -> None:
    """Write a picture; if that fails, an existing file is unchanged."""
    drawn = BytesIO()
    figure.savefig(drawn, format=path.suffix[1:], **options)
    write_whole(path, [drawn.getbuffer()])


def figure_of(draw: Callable[[Figure], None]) -> Figure:
    """
    Return the matplotlib ``Figure`` of a picture.

    Axes with labels get a legend at the upper left, unless the picture places it.

    :raises ImportError: matplotlib is missing.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    with rc_context(_SETTINGS):
        figure = Figure(figsize=(8.0, 4.2), dpi=_DPI, layout='constrained')
        draw(figure)
        for axes in figure.axes:
            is_placed = axes.get_legend() is not None or figure.legends
            if axes.get_legend_handles_labels()[0] and not is_placed:
                axes.legend(loc='upper left')
    return figure
