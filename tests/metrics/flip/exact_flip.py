# SPDX-License-Identifier: Apache-2.0
"""FLIP in float64, written down as the papers have it: two-dimensional kernels, no tiles, no caches, nothing shared.

References
----------
Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020; "Visualizing Errors in Rendered High
Dynamic Range Images", Eurographics 2021; constants of NVlabs/flip, FLIP.h 1.7.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import correlate

PPD = 0.7 * 3840 / 0.7 * np.pi / 180
XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = XYZ @ np.ones(3)
ACES = (0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14)


def exact_flip(reference, test, *, srgb=True):
    """The map of two pictures (height, width, 3) in [0, 1], display values or linear light."""
    pair = [np.clip(image.astype(np.float64), 0, 1) for image in (reference, test)]
    if srgb:
        pair = [np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) for c in pair]
    opponent = [_ycxcz(image @ XYZ.T / WHITE) for image in pair]
    labs = [_hunt_lab(np.clip(_from_ycxcz(_blurred(image)) * WHITE @ np.linalg.inv(XYZ).T, 0, 1)) for image in opponent]
    power = _hyab(*labs) ** 0.7
    green, blue = (_hunt_lab(np.eye(3)[c][None, None]) for c in (1, 2))
    largest = _hyab(green, blue) ** 0.7
    knee = 0.4 * largest
    upper = 0.95 + (power - knee) / (largest - knee) * 0.05
    colour = np.where(power < knee, power * 0.95 / knee, upper)
    detected = [_detected((image[..., 0] + 16) / 116) for image in opponent]
    edge, point = (np.abs(a - b) for a, b in zip(*detected, strict=True))
    feature = np.sqrt(np.maximum(edge, point) / np.sqrt(2))
    return colour ** (1 - np.minimum(feature, 1))


def exact_hdr_flip(reference, test):
    """The map of two linear pictures, ACES, in the official range of exposures."""
    reference, test = (np.maximum(image.astype(np.float64), 0) for image in (reference, test))
    a, b, c, d, e, f = ACES
    bright = max(np.roots([a - 0.85 * d, b - 0.85 * e, c - 0.85 * f]).real)
    light = np.sort((reference @ [0.2126, 0.7152, 0.0722]).ravel())
    start, stop = (np.log2(bright / max(y, 2.0**-23)) for y in (light[-1], light[len(light) // 2]))
    maps = []
    for ev in np.linspace(start, stop, max(2, int(np.ceil(stop - start)))):
        shown = [x * (a * x + b) / (x * (d * x + e) + f) for x in (reference * 2.0**ev, test * 2.0**ev)]
        maps.append(exact_flip(*shown, srgb=False))
    return np.max(maps, axis=0)


def _ycxcz(xyz):
    x, y, z = np.moveaxis(xyz, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def _from_ycxcz(image):
    y = (image[..., 0] + 16) / 116
    return np.stack([y + image[..., 1] / 500, y, y - image[..., 2] / 200], -1)


def _blurred(image):
    radius = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi**2)) * PPD))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1] / PPD
    planes = []
    for channel, gaussians in enumerate([[(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]):
        kernel = sum(a * np.sqrt(np.pi / b) * np.exp(-(np.pi**2) * (x**2 + y**2) / b) for a, b in gaussians)
        planes.append(correlate(image[..., channel], kernel / kernel.sum(), mode="nearest"))
    return np.stack(planes, -1)


def _hunt_lab(rgb):
    t = rgb @ XYZ.T / WHITE
    delta = 6 / 29
    fx, fy, fz = np.moveaxis(np.where(t > delta**3, np.cbrt(t), t / (3 * delta**2) + 4 / 29), -1, 0)
    lightness = 116 * fy - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (fx - fy), 0.01 * lightness * 200 * (fy - fz)], -1)


def _hyab(a, b):
    difference = a - b
    return np.abs(difference[..., 0]) + np.hypot(difference[..., 1], difference[..., 2])


def _detected(luminance):
    sigma = 0.5 * 0.082 * PPD
    radius = int(np.ceil(3 * sigma))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1].astype(float)
    gauss = np.exp(-(x**2 + y**2) / (2 * sigma**2))
    norms = []
    for kernel in (-x * gauss, (x**2 / sigma**2 - 1) * gauss):
        kernel = np.where(kernel > 0, kernel / kernel[kernel > 0].sum(), kernel / -kernel[kernel < 0].sum())
        norms.append(np.hypot(*(correlate(luminance, k, mode="nearest") for k in (kernel, kernel.T))))
    return norms
