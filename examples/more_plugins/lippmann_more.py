"""A display, a layout of light fields, a format of films and an integrator."""

from PIL import Image

from lippmann.plugins import Displays, Film, IntegratorFactory, Layout, RayCounts

ACME_9 = """
title = "A 9-inch tablet behind a lens sheet"
gap = 1.2
viewing_distance = "45 cm"
[panel]
width = 1024
height = 768
pixel_pitch = "144 dpi"
subpixel_offsets = "rgb"
[lens_array]
layout = "lenticular"
pitch = "16 lpi"
"""


def write_strip(light_field, display, path):
    """The views of the middle row side by side, from the left one to the right one."""
    middle = light_field.values[len(light_field.values) // 2]
    Image.fromarray(middle.transpose(1, 0, 2, 3).reshape(middle.shape[1], -1, 3)).save(path, format="PNG")


def write_gif(frames, path, frames_per_second):
    first, *others = [Image.fromarray(frame) for frame in frames]
    first.save(path, "GIF", save_all=True, append_images=others, duration=1000 / frames_per_second, loop=0)


class SkySeen:
    """How much of the sky a surface sees: a ray in a direction drawn by the cosine meets nothing."""

    def __init__(self, scene):
        self.scene = scene

    def sample(self, ray, stream, active):
        import drjit as dr
        import mitsuba as mi

        hit = self.scene.ray_intersect(ray, active)
        normal = mi.Frame3f(dr.select(dr.dot(hit.n, ray.d) < 0, hit.n, -hit.n))
        direction = normal.to_world(mi.warp.square_to_cosine_hemisphere(stream.next_2d(1)))
        is_hidden = self.scene.ray_test(hit.spawn_ray(direction), active & hit.is_valid())
        one = dr.full(mi.UInt32, 1, dr.width(hit.t))
        return mi.Spectrum(dr.select(is_hidden, 0.0, 1.0)), RayCounts(secondary=one * 0, shadow=one)


def make_sky_seen(built, request, frame_from_world):
    return SkySeen(built.mitsuba)


DISPLAYS = Displays({"acme-9": ACME_9})
STRIP = Layout(write_strip, bits={8: "uint8"}, ending=".png")
GIF = Film((".gif",), write_gif)
SKY_SEEN = IntegratorFactory(make_sky_seen)
