"""Light of lenses that an eye sees."""

from __future__ import annotations

from lippmann.optics.pixel_shares import pixel_shares


def lenses_seen_by(display, eye, lens):
    """:func:`pixel_shares` of lenses in the directions of an eye at ``(x, y, z)`` mm in the display's frame."""
    axis = display.lattice.origin_x + lens * display.lattice.pitch
    return pixel_shares(display, lens, (eye[0] - axis) / eye[2])
