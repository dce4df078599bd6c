# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pictures of docs/pick_and_place.md: error against speed, contact sheet, animation."""

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from PIL import Image as Picture, ImageDraw, ImageFont
from tf_tree_py.core import as_seconds, Pose
from tf_tree_py.labs.report import GREY, save, STYLES

from .image import Image, project
from .pick_and_place import LATENCY
from .report import Trial
from .scene import BLOCK_SIZE
from .speeds import errors_at, law, RADIUS, SPEEDS

_COLUMNS, _TILE, _GAP = 5, (192, 144), 4
_COLORS = 200
_GREEN, _WHITE, _BLACK = (0, 255, 80), (255, 255, 255), (0, 0, 0)
_SCALE_M = 0.1


def draw_all(trials: Sequence[Trial], folder: Path) -> list[Path]:
    """Write error against speed (PNG and SVG), and the contact sheet; return the files."""
    sheet = folder / 'pick_and_place_sheet.png'
    reduced(contact_sheet(trials), _COLORS).save(sheet, optimize=True)
    return [sheet, *save(_draw_errors, folder, 'pick_and_place_speed')]


def reduced(picture: Picture.Image, colors: int) -> Picture.Image:
    """Return a picture in few colours, which makes a small file."""
    return picture.quantize(colors, method=Picture.Quantize.MAXCOVERAGE,
                            dither=Picture.Dither.NONE)


# --- error against speed


def _draw_errors(figure: Any) -> None:
    axes = figure.subplots()
    speeds = [speed * RADIUS for speed in SPEEDS]
    errors = [errors_at(speed) for speed in SPEEDS]
    axes.plot((0.0, speeds[-1]), (0.0, law(speeds[-1]) * 100.0), color=GREY, linewidth=1.0,
              label=f'the law: v · {as_seconds(LATENCY):g} s')
    for style, field, label in ((STYLES[2], 'latest', 'the latest'),
                                (STYLES[0], 'stamped', "the image's stamp")):
        means = [100.0 * fmean(getattr(error, field) for error in group) for group in errors]
        axes.plot(speeds, means, **style | {'linestyle': 'none'}, label=label)
    axes.set(xlabel='speed of the arm at the block, v [m/s]', ylabel='error in the world [cm]',
             title='Where the block is taken to be, against where it is: the tree is asked for …')
    axes.legend(loc='upper left')


# --- contact sheet


def contact_sheet(trials: Sequence[Trial]) -> Picture.Image:
    """Return the image of each run, with its number, a scale, and the detection drawn in."""
    tiles = [_tile(trial) for trial in trials if trial.sight is not None]
    width, height = _TILE[0] + _GAP, _TILE[1] + _GAP
    rows = -(-len(tiles) // _COLUMNS)
    sheet = Picture.new('RGB', (_COLUMNS * width - _GAP, max(1, rows * height - _GAP)), _WHITE)
    for number, tile in enumerate(tiles):
        row, column = divmod(number, _COLUMNS)
        sheet.paste(tile, (column * width, row * height))
    return sheet


def _tile(trial: Trial) -> Picture.Image:
    image, camera_T_block = trial.sight
    tile = detection(image, camera_T_block).resize(_TILE, Picture.Resampling.LANCZOS)
    pen = ImageDraw.Draw(tile)
    write(pen, (3, 2), f'run {trial.number}', 'lt')
    # The scale holds at the distance of the block, across the optical axis.
    length = image.intrinsics.focal * _SCALE_M / camera_T_block.z * _TILE[0] / image.color.shape[1]
    right, bottom = _TILE[0] - 8, _TILE[1] - 8
    pen.rectangle((right - length, bottom - 2, right, bottom), fill=_BLACK, outline=_WHITE)
    write(pen, (right - length / 2, bottom - 5), f'{100 * _SCALE_M:.0f} cm', 'mb')
    return tile


def write(pen: ImageDraw.ImageDraw, place: tuple[float, float], text: str, anchor: str) -> None:
    """Write black text with a white border, which can be read on any picture."""
    pen.text(place, text, fill=_BLACK, font=ImageFont.load_default(11), anchor=anchor,
             stroke_width=2, stroke_fill=_WHITE)


def detection(image: Image, camera_T_block: Pose) -> Picture.Image:
    """Return an image with the outline of the block's top and its long axis."""
    picture = Picture.fromarray(image.color)
    x, y = BLOCK_SIZE[0] / 2, BLOCK_SIZE[1] / 2
    corners = ((x, y, 0.0), (-x, y, 0.0), (-x, -y, 0.0), (x, -y, 0.0))
    pen = ImageDraw.Draw(picture)
    pen.polygon(_pixels(camera_T_block, corners, image), outline=_GREEN, width=3)
    pen.line(_pixels(camera_T_block, ((-x, 0.0, 0.0), (x, 0.0, 0.0)), image), fill=_WHITE, width=2)
    return picture


def _pixels(camera_T_block: Pose, points: Sequence[Sequence[float]],
            image: Image) -> list[tuple[float, ...]]:
    pixels = project(camera_T_block @ np.array(points), image.intrinsics)
    return [tuple(pixel) for pixel in pixels.tolist()]
