"""Figures for the eye: how streaky, rough and even falling water looks, in photographs and pictures of taki.

    python figures.py PICTURE:X,Y,W,H ...          boxes of water in pictures
    python figures.py --frames PICTURE:X,Y,W,H ... the same box in frames that follow one another: flicker too

The flow runs down each box. Brightness is replaced by its rank among the box's pixels, so a tone curve
changes no figure. A picture is first reduced so that its box is 96 pixels wide, which also takes the noise of cameras
and of JPEG files away; boxes that are not so wide are refused.

Needs numpy and Pillow.
"""

import sys

import numpy as np
from PIL import Image

WIDTH = 96
# Waves per box width between which slopes are fitted: streaks and threads, but neither the box's own shape
# nor the last octave of the pixels.
BAND = (4, 24)


def box_of(argument):
    """The ranks of a box's pixels, 0 to 1, by row and column."""
    path, numbers = argument.rsplit(":", 1)
    x, y, w, h = map(int, numbers.split(","))
    if w < WIDTH:
        sys.exit(f"{argument}: the box is {w} pixels wide, fewer than {WIDTH}")
    picture = Image.open(path).convert("RGB").crop((x, y, x + w, y + h))
    picture = picture.resize((WIDTH, max(round(h * WIDTH / w), 16)), Image.Resampling.BOX)
    luma = np.asarray(picture, dtype=np.float64) @ [0.2126, 0.7152, 0.0722]
    # Ties keep their order in the picture; their ranks differ by less than a grey level.
    ranks = luma.ravel().argsort(kind="stable").argsort(kind="stable")
    return (ranks / (ranks.size - 1)).reshape(luma.shape)


def correlation_length(box, axis):
    """Distance along an axis at which the mean autocorrelation falls to one half, in box widths."""
    lines = box if axis == 1 else box.T
    lines = lines - lines.mean(axis=1, keepdims=True)
    n = lines.shape[1]
    power = np.abs(np.fft.rfft(lines, 2 * n, axis=1)) ** 2
    sums = np.fft.irfft(power, axis=1)[:, :n].sum(axis=0)
    # Fewer pairs of pixels lie far apart.
    correlation = sums / (n - np.arange(n))
    correlation /= correlation[0]
    below = np.flatnonzero(correlation < 0.5)
    if below.size == 0:
        return n / WIDTH
    i = below[0]
    part = (correlation[i - 1] - 0.5) / (correlation[i - 1] - correlation[i])
    return (i - 1 + part) / WIDTH


def slope(box, axis):
    """Slope of the mean power spectrum along an axis, between the waves of BAND, on logarithmic scales."""
    lines = box if axis == 1 else box.T
    lines = lines - lines.mean(axis=1, keepdims=True)
    n = lines.shape[1]
    power = (np.abs(np.fft.rfft(lines * np.hanning(n), axis=1)) ** 2).mean(axis=0)
    waves = np.arange(power.size) * WIDTH / n
    fit = (waves >= BAND[0]) & (waves <= BAND[1])
    return np.polyfit(np.log(waves[fit]), np.log(power[fit]), 1)[0]


def figures(box):
    """Correlation lengths across and along the flow, their ratio, and the slopes across and along."""
    across, along = correlation_length(box, 1), correlation_length(box, 0)
    return across, along, along / across, slope(box, 1), slope(box, 0)


def main():
    arguments = sys.argv[1:]
    frames = arguments[:1] == ["--frames"]
    boxes = [box_of(argument) for argument in arguments[frames:]]
    if not boxes:
        sys.exit(__doc__)
    print("| box | across | along | streak | slope across | slope along |")
    print("|---|--:|--:|--:|--:|--:|")
    for argument, box in zip(arguments[frames:], boxes):
        name = argument.rsplit("/", 1)[-1]
        across, along, streak, *slopes = figures(box)
        print(f"| {name} | {across:.3f} | {along:.3f} | {streak:.1f} | {slopes[0]:.1f} | {slopes[1]:.1f} |")
    if frames:
        changes = [np.abs(a - b).mean() for a, b in zip(boxes, boxes[1:])]
        print(f"flicker: {np.mean(changes):.3f}, mean change of rank from frame to frame")


main()
