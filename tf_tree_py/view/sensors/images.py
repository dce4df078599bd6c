# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Camera images as RGB pixels that are small enough for the controls of a page."""

from collections.abc import Callable
import io
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

Pixels: TypeAlias = npt.NDArray[np.uint8]

_WIDEST: Final = 320
_COLOURS: Final = {'rgb8': 3, 'bgr8': 3, 'rgba8': 4, 'bgra8': 4}
# One number for each pixel. A Bayer image appears grey, with its pattern.
_GREYS: Final = {
    'mono8': 'u1', '8UC1': 'u1', 'mono16': 'u2', '16UC1': 'u2', '32FC1': 'f4',
    **{f'bayer_{pattern}8': 'u1' for pattern in ('rggb', 'bggr', 'gbrg', 'grbg')}}


def raw_image(message: Any) -> Pixels:
    """
    Return the pixels of a sensor_msgs/Image, (H, W, 3).

    Depth images are scaled so that their smallest value is black and their largest is white.

    :raises ValueError: the encoding is not supported, or the message has too few bytes.
    """
    encoding, width = message.encoding, int(message.width)
    read: Callable[[npt.NDArray[np.uint8], int], Pixels]
    if encoding in _COLOURS:
        read = _coloured(encoding)
    elif encoding in _GREYS:
        read = _grey(('>' if message.is_bigendian else '<') + _GREYS[encoding])
    else:
        raise ValueError(f'images with the encoding {encoding!r} are not supported')
    data = np.frombuffer(bytes(message.data), np.uint8)
    if len(data) != message.height * message.step:
        raise ValueError(f'the image has {len(data)} bytes, but {message.height} rows of '
                         f'{message.step} bytes')
    rows = data.reshape(message.height, message.step)
    step = max(-(-width // _WIDEST), 1)
    return np.ascontiguousarray(read(rows, width)[::step, ::step])


def _coloured(encoding: str) -> Callable[[Pixels, int], Pixels]:
    channels = _COLOURS[encoding]

    def read(rows: Pixels, width: int) -> Pixels:
        pixels = rows[:, :width * channels].reshape(len(rows), width, channels)[:, :, :3]
        return pixels[:, :, ::-1] if encoding.startswith('bgr') else pixels

    return read


def _grey(kind: str) -> Callable[[Pixels, int], Pixels]:
    def read(rows: Pixels, width: int) -> Pixels:
        values = np.ascontiguousarray(rows[:, :width * np.dtype(kind).itemsize]).view(kind)
        return np.repeat(_stretched(values)[:, :, None], 3, axis=2)

    return read


def _stretched(values: npt.NDArray[Any]) -> Pixels:
    """Return one byte for each value: as it is, or from black to white over the finite ones."""
    if values.dtype.itemsize == 1:
        return values
    finite = values[np.isfinite(values)].astype(float)
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
    scaled = (values.astype(float) - low) * (255.0 / max(high - low, 1e-9))
    return np.nan_to_num(np.clip(scaled, 0.0, 255.0)).astype(np.uint8)


def compressed_image(message: Any) -> Pixels:
    """
    Return the pixels of a sensor_msgs/CompressedImage, (H, W, 3).

    :raises ValueError: the image is neither JPEG nor PNG, or it is damaged.
    """
    from PIL import Image
    if 'compressedDepth' in message.format:
        raise ValueError('compressed depth images are not supported')
    try:
        with Image.open(io.BytesIO(bytes(message.data)), formats=('JPEG', 'PNG')) as image:
            # A JPEG decoder can skip most of the work for a small picture.
            image.draft('RGB', (_WIDEST, _WIDEST))
            image.thumbnail((_WIDEST, image.height))
            return np.asarray(_as_rgb(image))
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(f'the compressed image cannot be read: {error}') from error


def _as_rgb(image: Any) -> Any:
    if image.mode.startswith('I') or image.mode == 'F':
        from PIL import Image
        return Image.fromarray(_stretched(np.asarray(image))).convert('RGB')
    return image.convert('RGB')
