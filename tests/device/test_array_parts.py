"""All arrays of a model are found, and nothing else: a frozen kernel must be shown each that it reads."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from lippmann.device.array_parts import arrays_of

pytestmark = pytest.mark.usefixtures("engine")


@dataclass(eq=False)
class Part:
    value: object
    name: str = "a"
    count: int = 3
    more: object = None


def test_arrays_and_textures_of_all_parts_are_found_once():
    import mitsuba as mi

    number, color, texels = mi.Float(1), mi.Color3f(1), mi.UInt32([1, 2])
    texture = mi.load_dict({"type": "checkerboard"})
    whole = Part((number, Part(color, more=Part(texture))), more=Part(number, more=(texels, None, 1.5)))
    found = arrays_of(whole)
    assert [id(each) for each in found] == [id(each) for each in (number, color, texture, texels)]


def test_plugins_show_their_arrays_and_hide_their_models():
    from lippmann.device.pbr.gltf_bsdf import surface_bsdf
    from lippmann.device.pbr.gltf_bsdf_parameters import SurfaceModel
    from lippmann.device.pbr.texture_lookup import Signal, numbers

    def signal(value):
        return Signal(numbers([value]))

    bsdf = surface_bsdf(SurfaceModel(Signal(numbers([(0.5, 0.2, 0.1)])), signal(0.5), signal(1.5)))
    assert list(vars(bsdf)) == ["arrays"]
    assert len(bsdf.arrays) == 3
