# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a lab: tables, the law that they show, numbers, and the picture."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from math import degrees
from pathlib import Path
import textwrap
from typing import Any, NamedTuple, TYPE_CHECKING

from tf_tree_py.files.whole_files import write_whole
from tf_tree_py.reports.plain_text import as_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:  # a lab without its picture needs no matplotlib
    Axes = Figure = object

_WIDTH = 96
# How many of a unit are in one of the SI, or in the whole.
_IN_ONE = {'mm': 1e3, 'cm': 100.0, 'ms': 1e3, 'deg': degrees(1.0), 'mrad': 1e3, 'kB': 1e-3,
           '%': 100.0}


class Column(NamedTuple):
    """
    One column of a table.

    :ivar key: its name in JSON; values there are in SI units.
    :ivar heading: its heading; the numbers below are in the unit at its end, such as ``[cm]``.
    :ivar style: the format of a number, such as ``.1f``.
    """

    key: str
    heading: str
    style: str = ''

    def write(self, value: object) -> str:
        """Return a value as text for the table; a dash for None."""
        if value is None:
            return '-'
        if isinstance(value, bool):
            return 'yes' if value else 'no'
        if not isinstance(value, (int, float)):
            return str(value)
        unit = self.heading.rpartition('[')[2].removesuffix(']')
        # Adding 0.0 turns a rounded -0.0 into 0.0.
        return format(round(value * _IN_ONE.get(unit, 1.0), 9) + 0.0 if self.style else value,
                      self.style)


@dataclass(frozen=True)
class Table:
    """Rows under headings, and a title."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[object]]

    def as_text(self) -> str:
        """Return the table as lines for a terminal: text is aligned left, numbers right."""
        cells = [[column.write(value) for column, value in zip(self.columns, row, strict=True)]
                 for row in self.rows]
        heads = [column.heading for column in self.columns]
        numbers = [number for number in range(len(heads))
                   if not any(isinstance(row[number], str) for row in self.rows)]
        return '\n'.join([self.title, *as_lines([heads, *cells], numbers, rule=True)])

    def as_dict(self) -> dict[str, object]:
        """Return the table for JSON: each row by the columns' keys."""
        keys = [column.key for column in self.columns]
        return {'title': self.title,
                'rows': [dict(zip(keys, row, strict=True)) for row in self.rows]}


@dataclass(frozen=True)
class Report:
    """
    The outcome of a lab.

    :ivar law: the law it shows, one sentence with the fitted numbers.
    :ivar remarks: further results, a paragraph each.
    :ivar numbers: the fitted numbers of the law, by name, for JSON; SI units.
    :ivar draw: draws the picture into a matplotlib ``Figure``.
    """

    tables: Sequence[Table]
    law: str
    remarks: Sequence[str] = ()
    numbers: Mapping[str, object] = field(default_factory=dict)
    draw: Callable[[Figure], None] | None = None

    def as_text(self) -> str:
        """Return the report for a terminal."""
        parts = [table.as_text() for table in self.tables]
        parts += [_wrapped(remark) for remark in self.remarks]
        return '\n\n'.join([*parts, _wrapped(f'The law: {self.law}')])

    def as_dict(self) -> dict[str, object]:
        """Return the report for JSON."""
        return {'law': self.law, 'numbers': dict(self.numbers), 'remarks': list(self.remarks),
                'tables': [table.as_dict() for table in self.tables]}


def _wrapped(text: str) -> str:
    """Wrap a paragraph; indented lines stay as they are."""
    lines = []
    for line in text.splitlines():
        lines += [line] if line.startswith(' ') else textwrap.wrap(line, _WIDTH)
    return '\n'.join(lines)


# --- the picture

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
