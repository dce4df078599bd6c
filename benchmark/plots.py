# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Plots of the results, readable in black and white."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from . import growth_plot
from .rows import DEBIAN, JAZZY, OURS, PLAIN, PURE, PYTRANSFORM, Row, RUST, TF2_ROS
from .timing import spread

# Each contestant has the same style in all plots: line, marker, fill, hatch.
LOOKS = {
    OURS: {'color': 'black', 'linestyle': '-', 'marker': 'o'},
    PURE: {'color': 'black', 'linestyle': '--', 'marker': 'o', 'markerfacecolor': 'white'},
    TF2_ROS: {'color': '#0060a8', 'linestyle': '--', 'marker': 's'},
    JAZZY: {'color': '#c84c00', 'linestyle': '-.', 'marker': '^'},
    DEBIAN: {'color': '#c84c00', 'linestyle': ':', 'marker': 'v'},
    RUST: {'color': '#007a5a', 'linestyle': ':', 'marker': 'D'},
}
# Longer names for the short names of the tables, for readers who have not seen the tables.
LONG_NAMES = {
    TF2_ROS: 'tf2_ros (Python, Jazzy)',
    JAZZY: "tf2's C++ buffer alone (Jazzy)",
    DEBIAN: "tf2's C++ buffer alone (Debian)",
    RUST: 'Rust (transform-tree)',
}
_FILLS = {
    OURS: {'color': 'black'},
    PLAIN: {'facecolor': 'white', 'edgecolor': 'black', 'hatch': '///'},
    TF2_ROS: {'facecolor': 'white', 'edgecolor': 'black', 'hatch': '...'},
}

# From left to right.
_LISTENERS = {
    TF2_ROS: 'TransformListener, tf2_ros (Python, Jazzy)',
    PLAIN: 'empty callback, plain rclpy',
    OURS: 'TransformListener, tf_tree_py',
}

# Of a control loop: the title, and whether the values span decades.
_MEASURES = {
    'a lookup, p50': ('a lookup, median', False),
    'the loop wakes late, p99': ('loop wakes late, 99th perc.', True),
    'CPU': ('CPU', False),
}

# From the bottom to the top.
_MARKERS = {
    PYTRANSFORM: {'marker': '^', 'fillstyle': 'none'},
    JAZZY: {'marker': 'v', 'fillstyle': 'none'},
    DEBIAN: {'marker': 's', 'fillstyle': 'none'},
    RUST: {'marker': 'D', 'fillstyle': 'none'},
    OURS: {'marker': 'o'},
}


def draw(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """
    Draw the plots for which there is data; return the files.

    :raises ImportError: matplotlib is not installed.
    """
    import matplotlib
    # With the salt, identical data produces identical files.
    with matplotlib.rc_context({'svg.hashsalt': 'tf_tree_py', 'font.size': 10,
                                'axes.spines.top': False, 'axes.spines.right': False}):
        return list(_drawn(folder, rows))


def _drawn(folder: Path, rows: Sequence[Row]) -> Iterator[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    plots = {'lookups': _lookups, 'listener': _listener, 'many': _many, 'control': _control}
    for name, plot in plots.items():
        figure = plot({row.name: row for row in rows if row.group == _GROUPS[name]})
        if figure is not None:
            yield from _save(figure, folder / f'performance_{name}')
    grown = growth_plot.figure(rows, LOOKS, LONG_NAMES)
    if grown is not None:
        yield from _save(grown, folder / 'performance_growth')


def _panels(columns: int, size: tuple[float, float], **options: Any) -> tuple[Any, Any]:
    """Return a figure and its panels, in one row; ``size`` is in inches."""
    from matplotlib.figure import Figure
    figure = Figure(figsize=size, layout='constrained')
    return figure, figure.subplots(1, columns, **options)


_GROUPS = {'lookups': 'depth', 'listener': 'listener', 'many': 'many', 'control': 'control'}


def _save(figure: Any, stem: Path) -> list[Path]:
    files = [stem.with_suffix('.svg'), stem.with_suffix('.png')]
    figure.savefig(files[0], metadata={'Date': None})
    figure.savefig(files[1], dpi=150)
    return files


def _lookups(rows: dict[str, Row]) -> Any:
    """Return a plot of the lookup time against the depth."""
    if not rows:
        return None
    figure, panels = _panels(2, (8.0, 4.2), sharey=True)
    for panel, where, title in zip(panels, ('30 ms old', 'latest'),
                                   ('30 ms before the newest sample', 'the latest'), strict=True):
        for name, look in LOOKS.items():
            # Of the fastest round, as in the text; see ``passages``.
            points = [(int(row.name.rsplit(' ', 1)[1]), spread(row.values[name]).least)
                      for row in rows.values()
                      if row.name.startswith(f'{where}, depth') and name in row.values]
            if points:
                panel.plot(*zip(*points, strict=True), label=LONG_NAMES.get(name, name),
                           markersize=4, **look)
        _scale(panel, [1, 2, 5, 10, 15, 38])
        panel.set_title(title, fontsize=10)
        panel.set_xlabel('moving edges between the frames')
    panels[0].set_ylabel('one lookup, fastest round [µs], logarithmic')
    # A contestant may be in one of the panels only.
    lines = {line.get_label(): line for panel in panels for line in panel.get_lines()}
    figure.legend(lines.values(), lines, loc='outside lower center', ncols=2, frameon=False,
                  fontsize=9)
    return figure


def _scale(panel: Any, ticks: Sequence[int]) -> None:
    panel.set_xscale('log')
    panel.set_yscale('log')
    panel.set_xticks(ticks, list(map(str, ticks)))
    panel.minorticks_off()
    panel.yaxis.set_major_formatter('{x:g}')
    panel.grid(visible=True, color='0.9')


def _listener(rows: dict[str, Row]) -> Any:
    """Return a plot of the CPU of listeners and of a plain subscription."""
    rows = {name: row for name, row in rows.items() if PLAIN in row.values}
    if not rows:
        return None
    ways = [way for way in _LISTENERS if any(way in row.values for row in rows.values())]
    figure, panel = _panels(1, (7.0, 3.2))
    width = 0.78 / len(ways)
    for place, way in enumerate(ways):
        heights = [_percent(row, way) if way in row.values else 0.0 for row in rows.values()]
        offset = (place - (len(ways) - 1) / 2.0) * width
        bars = panel.bar([number + offset for number in range(len(rows))], heights, 0.95 * width,
                         label=_LISTENERS[way], **_FILLS[way])
        panel.bar_label(bars, [f'{height:.2g}' if height < 10 else f'{height:.0f}'
                               for height in heights], fontsize=8)
    panel.set_xticks(range(len(rows)), [name.replace(' x ', ' × ') for name in rows])
    panel.set_xlabel('transforms in a message × rate')
    panel.set_ylabel('CPU, % of a core')
    panel.legend(frameon=False)
    return figure


def _percent(row: Row, way: str) -> float:
    rate_hz = int(row.name.split(' x ')[1].split()[0])
    return spread(row.values[way]).median * 1e-6 * rate_hz * 100.0


def _control(rows: dict[str, Row]) -> Any:
    """Return a plot of a control loop, one panel per measure, compared with tf2_ros."""
    if not rows:
        return None
    streams, measures = (list(dict.fromkeys(name.split(': ')[part] for name in rows))
                         for part in (0, 1))
    chosen = [measure for measure in measures if measure in _MEASURES]
    figure, panels = _panels(len(chosen), (9.0, 3.0), squeeze=False)
    for panel, measure in zip(panels[0], chosen, strict=True):
        of_measure = [rows[f'{stream}: {measure}'] for stream in streams
                      if f'{stream}: {measure}' in rows]
        for offset, way in ((-0.2, TF2_ROS), (0.2, OURS)):
            heights = [spread(row.values[way]).median if way in row.values else 0.0
                       for row in of_measure]
            bars = panel.bar([number + offset for number in range(len(heights))], heights, 0.38,
                             label=LONG_NAMES.get(way, way), **_FILLS[way])
            panel.bar_label(bars, [f'{height:.2g}' if height < 10 else f'{height:.0f}'
                                   for height in heights], fontsize=7)
        panel.set_xticks(range(len(streams)), [
            name.replace(' x ', ' × ').replace(', ', ',\n') for name in streams],
                         fontsize=8)
        title, logarithmic = _MEASURES[measure]
        if logarithmic:
            panel.set_yscale('log')
            panel.set_ylim(bottom=0.1)
            panel.yaxis.set_major_formatter('{x:g}')
        unit = of_measure[0].unit.replace('us', 'µs')
        panel.set_title(f'{title} [{unit}]' + (', log.' if logarithmic else ''), fontsize=9)
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc='outside lower center', ncols=3,
                  frameon=False, fontsize=8)
    return figure


def _many(rows: dict[str, Row]) -> Any:
    """Return a plot of the times for 100,000 stamps, as dots: bars need a zero on the axis."""
    chosen = [row for name, row in rows.items()
              if name in ('100,000 stamps, sorted', '100,000 stamps, shuffled')]
    if not chosen:
        return None
    figure, panels = _panels(len(chosen), (8.0, 2.4), sharex=True, sharey=True, squeeze=False)
    for panel, row in zip(panels[0], chosen, strict=True):
        names = [name for name in _MARKERS if name in row.values]
        for height, name in enumerate(names):
            # As in the text; see ``passages``.
            fastest = spread(row.values[name]).least
            panel.plot(fastest, height, color='black', markersize=8, linestyle='none',
                       **_MARKERS[name])
            label = f'{fastest:.3g}' if fastest < 100.0 else f'{fastest:,.0f}'
            panel.annotate(f'{label} ms', (fastest, height), (9, 0), va='center',
                           textcoords='offset points', fontsize=9)
        panel.set_yticks(range(len(names)), [
            f'{name}, a loop' if name in (DEBIAN, JAZZY) else name for name in names])
        panel.set_ylim(-0.6, len(names) - 0.4)
        panel.set_xscale('log')
        panel.set_xlim(1.0, 10_000.0)
        panel.set_xticks([1, 10, 100, 1000], ['1', '10', '100', '1,000'])
        panel.minorticks_off()
        panel.grid(visible=True, color='0.9')
        panel.set_axisbelow(True)
        panel.set_title(row.name, fontsize=10)
        panel.set_xlabel('fastest round [ms], logarithmic')
    return figure
