#!/usr/bin/python3
"""Makes an animated WebP of pictures: animate.py FOLDER OUT.webp FRAMES_PER_SECOND MOST_BYTES

FOLDER/N.png is shown from frame N on until the next one. With the best quality that fits. Debian's python3-pil.
"""

import pathlib
import sys

from PIL import Image


def main():
    folder, out, rate_hz, most_bytes = sys.argv[1:]
    paths = sorted(pathlib.Path(folder).glob("*.png"), key=lambda path: int(path.stem))
    pictures = [Image.open(path).convert("RGB") for path in paths]
    frames = [int(path.stem) for path in paths]
    shown_ms = [round(1000 * (b - a) / float(rate_hz)) for a, b in zip(frames, frames[1:], strict=False)] + [1000]

    def size_of(quality):
        pictures[0].save(
            out, save_all=True, append_images=pictures[1:], duration=shown_ms, loop=0, quality=quality, method=4
        )
        return pathlib.Path(out).stat().st_size

    fits, above = 0, 80
    while above - fits > 5:
        quality = (fits + above) // 2
        fits, above = (quality, above) if size_of(quality) <= int(most_bytes) else (fits, quality)
    size = size_of(fits)
    print(f"{out}: {len(pictures)} pictures, {size} bytes, quality {fits}")
    return 0 if size <= int(most_bytes) else 1


if __name__ == "__main__":
    sys.exit(main())
