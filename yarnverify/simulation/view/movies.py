"""Movies as files: GIF by pillow, MP4 by imageio-ffmpeg."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import NotRunError
from yarnverify.files import whole

Pixels = NDArray[np.uint8]


def write_movie(images: Iterator[Pixels], path: Path, rate: float, keep: Pixels) -> Path:
    """Write images (height, width, 3) as they come.

    Parameters
    ----------
    rate
        Frames a second.
    keep
        Colours (n, 3) that a format with few colours has to have: those of the legend.
    """
    with whole(path) as part:
        if path.suffix == ".mp4":
            _mp4(images, part, rate)
        else:
            _gif(images, part, rate, keep)
    return path


def _gif(images: Iterator[Pixels], path: Path, rate: float, keep: Pixels) -> None:
    from PIL import Image

    packed = []  # six bits a channel: what a palette of 256 could tell apart, in a third of the memory
    seen = np.zeros(1 << 18, np.int64)
    for image in images:
        code = (image >> 2).astype(np.int32) @ np.array([1 << 12, 1 << 6, 1], np.int32)
        seen += np.bincount(code.ravel(), minlength=len(seen))
        packed.append(code)
    palette = _palette(seen, keep)
    nearest = _nearest(np.flatnonzero(seen), palette, len(seen))
    frames = [Image.fromarray(nearest[code]) for code in packed]
    for frame in frames:
        frame.putpalette(palette.ravel().tolist())
    more = {"save_all": True, "append_images": frames[1:], "duration": round(1000 / rate), "loop": 0, "optimize": False}
    frames[0].save(path, **more)


def _palette(seen: NDArray[np.int64], keep: Pixels) -> Pixels:
    """One palette for all frames, so that nothing flickers, (256, 3): white, ink, the legend, and of the rest what is there."""
    from PIL import Image

    fixed = np.unique(np.concatenate([[[255, 255, 255], [34, 34, 34]], keep]), axis=0).astype(np.uint8)
    codes = np.flatnonzero(seen)
    often = np.minimum(np.ceil(np.sqrt(seen[codes])), 64).astype(int)  # shades of a few pixels count as well
    sample = _colours(np.repeat(codes, often))
    chosen = Image.fromarray(sample[None]).quantize(256 - len(fixed), Image.Quantize.MEDIANCUT, kmeans=1).getpalette()
    free = np.array(chosen or [255] * 3, np.uint8).reshape(-1, 3)[: 256 - len(fixed)]
    return np.concatenate([fixed, free, np.full((256 - len(fixed) - len(free), 3), 255, np.uint8)])


def _nearest(codes: NDArray[np.int64], palette: Pixels, count: int) -> Pixels:
    """Index in the palette for each colour that occurs, (count,)."""
    from scipy.spatial import cKDTree

    found = np.zeros(count, np.uint8)
    found[codes] = cKDTree(palette.astype(float)).query(_colours(codes).astype(float))[1]
    return found


def _colours(codes: NDArray[np.int64]) -> Pixels:
    """Colours of packed codes; the lightest is white and the darkest black."""
    channels = np.stack([codes >> 12, (codes >> 6) & 63, codes & 63], axis=1)
    return np.rint(channels * (255 / 63)).astype(np.uint8)


def _mp4(images: Iterator[Pixels], path: Path, rate: float) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise NotRunError("an .mp4 needs imageio-ffmpeg (pip install imageio-ffmpeg); a .gif does not") from None
    writer = None
    for image in images:
        even = np.ascontiguousarray(image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2])  # what H.264 takes
        if writer is None:
            size = (even.shape[1], even.shape[0])
            writer = imageio_ffmpeg.write_frames(
                str(path), size, fps=rate, codec="libx264", quality=8, macro_block_size=2
            )
            writer.send(None)
        writer.send(even)
    if writer is not None:
        writer.close()
