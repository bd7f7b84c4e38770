"""Whether native pixels reach the lenses, measured in one photograph of a pattern that the panel shows.

A sub-pixel of the colour c (0 R, 1 G, 2 B) at the phase f across its lens has the linear value
(1 + cos 2 pi (f - c / 3)) / 2: each view has one hue. A camera in the viewing zone sees one view of all lenses, so the
whole panel has one hue. If the picture is scaled, turned or stretched on its way, hues follow each other in bands.

A black frame surrounds the pattern, with a square in each corner: red, green, blue and white, clockwise from the upper
left. The squares tell how the picture lies, and what the camera makes of the panel's primaries and of its black.
In the photograph, rectified by the four corners of the pattern, the phase is the argument of R + G w + B w^2,
w = exp(2 pi i / 3). Its largest Fourier component has as many cycles to the right and downwards as there are bands.
A picture that is 1 + s times as large has -s K of them, K being the lenses that the pattern covers along both axes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import decode_srgb, quantize
from lippmann.display import Display
from lippmann.errors import PictureError, UsageError

Real = NDArray[np.float64]

#: Width of the black frame, and side of the squares in its corners, in shorter sides of the panel.
_FRAME, _SQUARE = 0.08, 0.055
#: Colours of the squares, clockwise from the upper left.
_SQUARES = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], np.float64)
#: Corners of a unit square in the same order, x to the right and y downwards.
_CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)

#: Rows that are drawn at a time.
_ROWS = 64
#: Longest side of a photograph as it is measured, and least side of the pattern in it, in pixels.
_LONGEST, _LEAST = 1200, 100
# Limits were halved and doubled on 201 simulated photographs of two slanted panels and a hexagonal array: blur, noise,
# uneven light, angle, lens blur; pictures scaled, turned, stretched, mirrored and mixed.
#: Share of the pattern's brightness below which there is no square. Half: no change; double: uneven light is refused;
#: without it a picture 4 % too large gives a wrong scale.
_DARK = 0.15
#: Samples of the pattern along each axis, and of a block of them; share of the pattern beyond them on each side.
#: Half or double that share: no change.
_SAMPLES, _BLOCK, _EDGE = 512, 16, 0.03
#: Share of full modulation below which no hue is told from grey. Half: a picture mixed over three lenses (0.16) passes;
#: double: light of half a pitch (0.24), as of lenses out of focus, is called mixed.
_GREY = 0.2
#: Bands that a camera may feign, by its lens or wrong corners. Half: no change; double: a turn by 0.3 degrees passes.
_SLACK = 0.3
#: Least share of the distance asked for at which a camera may stand. 0.875: no change; 0.5: a picture 2 % too small
#: passes on the array.
_NEAR = 0.75


def draw_photograph_pattern(display: Display) -> Pixels:
    """The pattern that is photographed.

    Returns
    -------
    ``(H, W, 3)`` uint8 codes in sRGB, native pixels.

    Raises
    ------
    UsageError
        The display is a monitor with eye tracking, whose lenses are not known.

    Examples
    --------
    >>> from lippmann.calibration.panel_photograph import draw_photograph_pattern
    >>> draw_photograph_pattern(lippmann.load_display("seed-lenticular")).shape
    (512, 512, 3)
    """
    _check_lenses(display)
    panel = display.panel
    pixels = np.empty((panel.height, panel.width, 3), np.float32)
    for top in range(0, panel.height, _ROWS):
        u, v = np.meshgrid(np.arange(panel.width) + 0.5, np.arange(top, min(top + _ROWS, panel.height)) + 0.5)
        for channel in range(3):
            phase = _phase(display, u, v, channel)
            pixels[top : top + _ROWS, :, channel] = 0.5 + 0.5 * np.cos(2 * np.pi * (phase - channel / 3))
    frame, square = _frame(display)
    pixels[:frame] = pixels[-frame:] = 0.0
    pixels[:, :frame] = pixels[:, -frame:] = 0.0
    far = (panel.width - square, panel.height - square)
    for (right, down), color in zip(_CORNERS.astype(int), _SQUARES, strict=True):
        left, top = right * far[0], down * far[1]
        pixels[top : top + square, left : left + square] = color
    return quantize(pixels, 8, "srgb").astype(np.uint8, copy=False)


def check_photograph(codes: Pixels, display: Display, distance: float) -> str:
    """Tell from a photograph of the pattern whether native pixels reach the lenses.

    Parameters
    ----------
    codes:
        ``(h, w, 3)`` uint8 in sRGB: the whole panel, dark around it.
    display:
        The display that shows :func:`draw_photograph_pattern`.
    distance:
        From the camera to the lenses in mm, above 0, within a quarter.

    Returns
    -------
    The result in one line; it begins with "Native pixels reach the lenses" where each reaches its own place.

    Raises
    ------
    PictureError
        The photograph does not show the pattern.
    UsageError
        As :func:`draw_photograph_pattern`.
    """
    _check_lenses(display)
    step = max(1, math.ceil(max(codes.shape[:2]) / _LONGEST))
    light = _reduce(decode_srgb(codes[..., :3].astype(np.float32) / 255.0).astype(np.float64), step)
    matrix = _homography(_pattern_corners(light))
    values = _sample(light, matrix, _inside())
    black = np.median(_sample(light, matrix, _ring(display)), axis=(0, 1))
    brightness = float(np.median((values - black).max(axis=-1)))
    colors, first, is_mirrored = _squares_at(light - black, matrix, display, brightness)
    if is_mirrored or first != 0:
        how = "mirrored" if is_mirrored else "upside down" if first == 2 else "turned by 90 degrees"
        return f"The picture is {how} on the panel: no pixel is in its own place."
    return _judge(_phasor(values - black, colors), display, distance)


def _check_lenses(display: Display) -> None:
    if display.stereo is not None:
        raise UsageError("nothing to photograph: eye tracking moves its views", where=display.name)


def _phase(display: Display, u: Real, v: Real, channel: int) -> Real:
    """Phase of sub-pixels across their lenses in lenses, 0 in the middle."""
    x, y = display.subpixel_point(u, v, np.full_like(u, channel))
    center_x, center_y = display.lens_center(*display.lens_of(x, y), x, y)
    k = 1.0 / display.magnification
    return np.asarray(display.lattice.across(x * k - center_x, y * k - center_y) / display.lens_array.pitch)


def _frame(display: Display) -> tuple[int, int]:
    """Width of the frame and side of its squares in pixels."""
    shorter = min(display.panel.width, display.panel.height)
    return max(1, round(_FRAME * shorter)), max(1, round(_SQUARE * shorter))


def _reduce(light: Real, step: int) -> Real:
    """A picture of means over ``step`` x ``step`` pixels."""
    height, width = (side // step * step for side in light.shape[:2])
    means: Real = light[:height, :width].reshape(height // step, step, width // step, step, 3).mean(axis=(1, 3))
    return means


def _pattern_corners(light: Real) -> Real:
    """Corners (x, y) of the pattern in a photograph, clockwise from the upper left: of its largest bright part."""
    from scipy import ndimage

    brightness = ndimage.gaussian_filter(light.max(axis=-1), 1.0)
    # A pattern that blurs to grey is half as bright; light may fall off to 0.3. At 0.15 dim rooms are refused,
    # at 0.3 light that falls off to 0.15.
    bright, count = ndimage.label(brightness > 0.2 * np.quantile(brightness, 0.98))
    if count == 0:
        raise PictureError("the photograph is black", fix="expose it longer")
    sizes = np.bincount(bright.ravel())[1:]
    y, x = np.nonzero(bright == 1 + np.argmax(sizes))
    corners = np.array([(x[i], y[i]) for i in (np.argmin(x + y), np.argmax(x - y), np.argmax(x + y), np.argmin(x - y))])
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    following = np.roll(corners, -1, axis=0)
    area = 0.5 * np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0])
    # A rectangle in perspective fills its four corners; a lit room or a hand does not. Half or double the tolerance
    # changes no photograph of a panel.
    if sides.min() < _LEAST or not 0.93 < len(x) / max(area, 1.0) < 1.1:
        raise PictureError(
            "the photograph shows no bright rectangle",
            fix=f"take all of the panel, at least {_LEAST} pixels high, in a dark room",
        )
    return corners.astype(np.float64)


def _homography(quad: Real) -> Real:
    """The projective map ``(3, 3)`` from the unit square to four corners (x, y)."""
    rows = []
    for (u, v), (x, y) in zip(_CORNERS, quad, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -u * x, -v * x], [0, 0, 0, u, v, 1, -u * y, -v * y]]
    return np.append(np.linalg.solve(np.array(rows), quad.ravel()), 1.0).reshape(3, 3)


def _inside() -> Real:
    """Points all over the pattern but for its edges."""
    at = np.linspace(_EDGE, 1 - _EDGE, _SAMPLES)
    return np.stack(np.meshgrid(at, at), axis=-1)


def _sample(light: Real, matrix: Real, points: Real) -> Real:
    """Values of the photograph at points ``(n, m, 2)`` of the unit square."""
    from scipy import ndimage

    x, y, w = np.moveaxis(np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ matrix.T, -1, 0)
    place = [y / w, x / w]
    return np.stack(
        [ndimage.map_coordinates(light[..., channel], place, order=1, mode="nearest") for channel in range(3)], axis=-1
    )


def _margins(display: Display) -> tuple[float, float, float]:
    """Width and height of the pattern inside its frame, and the frame's width, in pixels."""
    frame, _ = _frame(display)
    return display.panel.width - 2.0 * frame, display.panel.height - 2.0 * frame, float(frame)


def _ring(display: Display) -> Real:
    """Points of the black frame, in the middle of its sides, in units of the pattern inside."""
    width, height, frame = _margins(display)
    along = np.linspace(0.2, 0.8, 16)
    right, down = 0.5 * frame / width, 0.5 * frame / height
    level = np.ones_like(along)
    sides = [(along, -down * level), (along, (1 + down) * level), (-right * level, along), ((1 + right) * level, along)]
    return np.stack([np.stack(side, axis=-1) for side in sides])


def _squares_at(light: Real, matrix: Real, display: Display, brightness: float) -> tuple[Real, int, bool]:
    """The four squares' colours in the order of :data:`_SQUARES`, the corner of the first, and whether they run back.

    ``brightness`` is the pattern's. A picture that is turned by 90 degrees fills the panel, frame and all.
    """
    width, height, frame = _margins(display)
    _, square = _frame(display)

    def colors_of(sides: tuple[float, float]) -> Real:
        place, around = (frame - square / 2) / np.array(sides), np.linspace(-0.25, 0.25, 5) * square
        points = np.where(_CORNERS > 0, 1 + place, -place)
        grid = np.stack(np.meshgrid(around / sides[0], around / sides[1]), axis=-1).reshape(1, -1, 2)
        return np.asarray(np.median(_sample(light, matrix, points[:, None] + grid), axis=1))

    upright, turned = colors_of((width, height)), colors_of((height, width))
    colors = max(upright, turned, key=lambda each: float(each.max(axis=-1).min()))
    shares = colors / np.maximum(np.abs(colors).sum(axis=-1, keepdims=True), 1e-9)
    # Which corner is the reddest, the greenest and the bluest; the fourth is white.
    corners = [int(np.argmax(shares[:, channel])) for channel in range(3)]
    white = ({0, 1, 2, 3} - set(corners)).pop()
    order = [*corners, white]
    clockwise = [(corners[0] + step) % 4 for step in range(4)] == order
    back = [(corners[0] - step) % 4 for step in range(4)] == order
    if not (clockwise or back) or colors.max(axis=-1).min() < _DARK * brightness:
        raise PictureError(
            "the photograph does not show the squares in the pattern's corners",
            fix="take all of the panel in a dark room; if you see none either, the picture is scaled beyond the panel",
        )
    return colors[order], corners[0], back


def _phasor(values: Real, squares: Real) -> NDArray[np.complex128]:
    """Hue and modulation (0 to 1) of each sample, as complex numbers, by the colours of the squares in black light."""
    primaries = squares[:3].T
    # The white square says how strong the primaries are beside each other where the light is uneven.
    strengths = np.clip(np.linalg.solve(primaries, squares[3]), 0.2, 5.0)
    red, green, blue = np.moveaxis(values @ np.linalg.inv(primaries * strengths).T, -1, 0)
    turn = np.exp(2j * np.pi / 3)
    hue = red + green * turn + blue * turn**2
    return np.asarray(2.0 * hue / np.maximum(red + green + blue, 1e-3), np.complex128)


def _judge(phasor: NDArray[Any], display: Display, distance: float) -> str:
    """The result of the phases all over the pattern."""
    width, height, _ = _margins(display)
    covered = (1 - 2 * _EDGE) * np.array([width, height]) * display.panel.pixel_pitch
    angle = math.radians(display.lens_array.slant) if display.lens_array.layout == "lenticular" else 0.0
    lenses = covered * (math.cos(angle), math.sin(angle)) / (display.lens_array.pitch * display.magnification)
    bands, modulation, middle = _largest_component(phasor)
    if modulation < _GREY:
        return f"No hue is to be seen ({100 * modulation:.0f} % of it): pixels are mixed on the way to the panel."
    count, total = math.hypot(*bands), float(lenses @ lenses)
    grown = -float(bands @ lenses) / total
    parallax = display.gap / distance / display.magnification
    expected = 1.0 - 1.0 / display.magnification - parallax
    scale, error = 1 + grown - expected, (1 / _NEAR - 1) * parallax + _SLACK / math.sqrt(total)
    is_size = math.hypot(*(bands + grown * lenses)) < _SLACK
    if is_size and abs(scale - 1) <= error:
        line = f"Native pixels reach the lenses: {count:.1f} bands, scale {scale:.4f} within {error:.4f}"
        return f"{line}, view {middle:+.2f} lenses off the middle."
    what = f"The panel shows {count:.1f} bands of hue, not {abs(expected) * math.sqrt(total):.1f}"
    if is_size and round(scale) == 0:  # the bands are the lenses' own pitch
        return f"{what}: the photograph shows the pixels without lenses."
    if is_size:
        return f"{what}: the picture is scaled to {100 * scale:.1f} % of its size."
    return f"{what}: the picture is turned or stretched, or the lenses are others."


def _largest_component(phasor: NDArray[Any]) -> tuple[Real, float, float]:
    """Cycles to the right and downwards of the largest Fourier component, its size, and its phase in the middle."""
    side = len(phasor)
    ramp = np.arange(side) - (side - 1) / 2
    window = np.hanning(side)[:, None] * np.hanning(side)
    spectrum = np.abs(np.fft.fft2(phasor * window))
    row, column = np.unravel_index(np.argmax(spectrum), spectrum.shape)
    cycles = np.array([np.fft.fftfreq(side)[column], np.fft.fftfreq(side)[row]])
    for _ in range(3):  # the rest is below a cycle over the pattern; means over blocks hide single lenses
        slow = window * phasor * np.exp(-2j * np.pi * (cycles[0] * ramp + cycles[1] * ramp[:, None]))
        blocks = slow.reshape(side // _BLOCK, _BLOCK, side // _BLOCK, _BLOCK).mean(axis=(1, 3))
        right = np.sum(blocks[:, 1:] * blocks[:, :-1].conj())
        down = np.sum(blocks[1:] * blocks[:-1].conj())
        cycles = cycles + np.angle([right, down]) / (2 * np.pi * _BLOCK)
    slow = phasor * np.exp(-2j * np.pi * (cycles[0] * ramp + cycles[1] * ramp[:, None]))
    mean = np.sum(window * slow) / window.sum()
    return cycles * side, float(abs(mean)), float(np.angle(mean)) / (2 * np.pi)
