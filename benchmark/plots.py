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

"""The plots of the results, readable in black and white."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .rows import DEBIAN, JAZZY, OURS, PLAIN, PYTRANSFORM, Row, RUST, TF2_ROS
from .timing import spread

# Each contestant looks the same everywhere: line, marker, fill, hatch.
_LOOKS = {
    OURS: {'color': 'black', 'linestyle': '-', 'marker': 'o'},
    DEBIAN: {'color': '0.45', 'linestyle': '--', 'marker': 's'},
    JAZZY: {'color': '0.45', 'linestyle': '-.', 'marker': '^'},
    TF2_ROS: {'color': '0.3', 'linestyle': (0, (8, 2)), 'marker': 'v'},
    RUST: {'color': '0.55', 'linestyle': ':', 'marker': 'D'},
}
_FILLS = {
    OURS: {'color': 'black'},
    PLAIN: {'facecolor': 'white', 'edgecolor': 'black', 'hatch': '///'},
}

# From the bottom to the top.
_MARKERS = {
    PYTRANSFORM: {'marker': '^', 'fillstyle': 'none'},
    DEBIAN: {'marker': 's', 'fillstyle': 'none'},
    RUST: {'marker': 'D', 'fillstyle': 'none'},
    OURS: {'marker': 'o'},
}


def draw(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """
    Draw what there is data for; return the files.

    :raises ImportError: there is no matplotlib.
    """
    import matplotlib
    matplotlib.use('Agg')
    # The same data gives the same file.
    matplotlib.rcParams.update({'svg.hashsalt': 'tf_tree_py', 'font.size': 10,
                                'axes.spines.top': False, 'axes.spines.right': False})
    folder.mkdir(parents=True, exist_ok=True)
    plots = {'lookups': _lookups, 'listener': _listener, 'many': _many}
    written = []
    for name, plot in plots.items():
        figure = plot({row.name: row for row in rows if row.group == _GROUPS[name]})
        if figure is not None:
            written += _save(figure, folder / f'performance_{name}')
    return written


_GROUPS = {'lookups': 'depth', 'listener': 'listener', 'many': 'many'}


def _save(figure: Any, stem: Path) -> list[Path]:
    files = [stem.with_suffix('.svg'), stem.with_suffix('.png')]
    figure.savefig(files[0], metadata={'Date': None})
    figure.savefig(files[1], dpi=150)
    return files


def _lookups(rows: dict[str, Row]) -> Any:
    """Return lookup time over depth."""
    if not rows:
        return None
    from matplotlib import pyplot
    figure, panels = pyplot.subplots(1, 2, figsize=(8.0, 3.6), sharey=True, layout='constrained')
    for panel, where, title in zip(panels, ('middle', 'latest'),
                                   ('in the middle of 1 s', 'the latest'), strict=True):
        for name, look in _LOOKS.items():
            points = [(int(row.name.rsplit(' ', 1)[1]), spread(row.values[name]).median)
                      for row in rows.values()
                      if row.name.startswith(where) and name in row.values]
            if points:
                panel.plot(*zip(*points, strict=True), label=name, markersize=4, **look)
        _scale(panel, [1, 2, 5, 10, 38])
        panel.set_title(title, fontsize=10)
        panel.set_xlabel('moving edges between the frames')
    panels[0].set_ylabel('time of a lookup, µs')
    # Where no line is.
    panels[-1].legend(frameon=False, loc='upper left', labelspacing=0.25)
    return figure


def _scale(panel: Any, ticks: Sequence[int]) -> None:
    panel.set_xscale('log')
    panel.set_yscale('log')
    panel.set_xticks(ticks, list(map(str, ticks)))
    panel.minorticks_off()
    panel.yaxis.set_major_formatter('{x:g}')
    panel.grid(visible=True, color='0.9')


def _listener(rows: dict[str, Row]) -> Any:
    """Return the CPU of listening, ours beside the plain one's."""
    rows = {name: row for name, row in rows.items() if PLAIN in row.values}
    if not rows:
        return None
    from matplotlib import pyplot
    figure, panel = pyplot.subplots(figsize=(6.0, 3.2), layout='constrained')
    for offset, way, label in ((-0.19, PLAIN, 'empty callback, plain rclpy'),
                               (0.19, OURS, 'TransformListener, tf_tree_py')):
        heights = [_percent(row, way) for row in rows.values()]
        bars = panel.bar([number + offset for number in range(len(rows))], heights, 0.36,
                         label=label, **_FILLS[way])
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


def _many(rows: dict[str, Row]) -> Any:
    """Return the times for 100,000 stamps, as dots: a logarithmic axis has no zero for bars."""
    chosen = [row for name, row in rows.items()
              if name in ('100,000 stamps, sorted', '100,000 stamps, shuffled')]
    if not chosen:
        return None
    from matplotlib import pyplot
    figure, panels = pyplot.subplots(1, len(chosen), figsize=(8.0, 2.4), sharex=True, sharey=True,
                                     layout='constrained', squeeze=False)
    for panel, row in zip(panels[0], chosen, strict=True):
        names = [name for name in _MARKERS if name in row.values]
        for height, name in enumerate(names):
            median = spread(row.values[name]).median
            panel.plot(median, height, color='black', markersize=8, linestyle='none',
                       **_MARKERS[name])
            panel.annotate(f'{median:.3g} ms', (median, height), (9, 0), va='center',
                           textcoords='offset points', fontsize=9)
        panel.set_yticks(range(len(names)), [
            f'{name}, a loop' if name == DEBIAN else name for name in names])
        panel.set_ylim(-0.6, len(names) - 0.4)
        panel.set_xscale('log')
        panel.set_xlim(1.0, 5000.0)
        panel.set_xticks([1, 10, 100, 1000], ['1', '10', '100', '1000'])
        panel.minorticks_off()
        panel.grid(visible=True, color='0.9')
        panel.set_axisbelow(True)
        panel.set_title(row.name, fontsize=10)
        panel.set_xlabel('ms (logarithmic)')
    return figure
