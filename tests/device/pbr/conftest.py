"""Small scenes to build and to look at with single rays, whose answers are known by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from lippmann.scene.values.description import Instance, Mesh, SceneDescription


def square(material=0, *, half=1.0, z=0.0, uvs=None, normals=None, colors=None, name="square"):
    """A square in the plane z that faces +z; by default the picture of a texture stands upright on it."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float32) * half
    positions = np.column_stack([corners, np.full(4, z, np.float32)])
    if uvs is None:
        uvs = (np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32),)
    return Mesh(name, positions, np.array([(0, 1, 2), (0, 2, 3)], np.uint32), material, normals, uvs, colors)


def ball(material=0, *, radius=1.0, steps=48, name="ball"):
    """A smooth sphere."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, steps), np.linspace(0, 2 * np.pi, 2 * steps), indexing="ij")
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    index = np.arange(theta.size).reshape(theta.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.uint32)
    uvs = np.column_stack([phi.ravel(), theta.ravel()]).astype(np.float32) / (2 * np.pi, np.pi)
    normals = normals.astype(np.float32)
    return Mesh(name, normals * np.float32(radius), faces, material, normals, (uvs.astype(np.float32),))


def shift(x=0.0, y=0.0, z=0.0, scale=(1.0, 1.0, 1.0)):
    matrix = np.diag([*scale, 1.0]).astype(float)
    matrix[:3, 3] = (x, y, z)
    return matrix


def describe(meshes, materials, *, instances=None, **rest):
    if instances is None:
        instances = [Instance(number, np.eye(4)) for number in range(len(meshes))]
    return SceneDescription("scene", meshes, materials, instances, **rest)


@dataclass(frozen=True)
class Looker:
    """Looks at built scenes with rays."""

    def hit(self, built, x, y, *, z=5.0, toward=-1.0):
        """Surface interactions of rays along the z axis through ``(x, y)``."""
        import mitsuba as mi

        from lippmann.device.kernel_ops import upload

        x, y = np.broadcast_arrays(np.asarray(x, np.float32), np.asarray(y, np.float32))
        origin = mi.Point3f(upload(x), upload(y), z)
        ray = mi.Ray3f(origin, mi.Vector3f(0, 0, toward))
        return built.mitsuba.ray_intersect(ray, mi.RayFlags.All, True)

    def emitted(self, built, x, y, **where):
        """Radiance that surfaces or surroundings give off toward such rays, ``(n, 3)``."""
        si = self.hit(built, x, y, **where)
        return np.array(si.emitter(built.mitsuba).eval(si)).T

    def attribute(self, built, name, x, y, **where):
        """A colour-valued attribute of the surfaces hit, ``(n, 3)``."""
        si = self.hit(built, x, y, **where)
        return np.array(si.bsdf().eval_attribute_3(name, si)).T

    def scalar(self, built, name, x, y, **where):
        si = self.hit(built, x, y, **where)
        return np.array(si.bsdf().eval_attribute_1(name, si))

    def opacity(self, built, x, y, **where):
        si = self.hit(built, x, y, **where)
        return 1 - np.array(si.bsdf().eval_null_transmission(si))[0]

    def picture(self, built, *, size=16, samples=16, depth=8, origin=(0, 0, 5), target=(0, 0, 0), half=1.0, seed=0):
        """A plain rendering ``(size, size, 3)`` by Mitsuba's own path tracer, seen in parallel, row 0 on top."""
        import mitsuba as mi

        frame = mi.ScalarTransform4f().look_at(list(origin), list(target), [0, 1, 0])
        sensor = mi.load_dict(
            {
                "type": "orthographic",
                "to_world": frame @ mi.ScalarTransform4f().scale([half, half, 1]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            }
        )
        integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 100})
        return np.array(mi.render(built.mitsuba, sensor=sensor, integrator=integrator, spp=samples, seed=seed))


@pytest.fixture(scope="session")
def look(engine) -> Looker:
    del engine
    return Looker()


@pytest.fixture(scope="session")
def build(engine):
    """Builds a description."""
    del engine
    from lippmann.device.pbr import build_description

    return build_description


@pytest.fixture(scope="session")
def parts():
    """The scenes' parts, by name."""
    from types import SimpleNamespace

    return SimpleNamespace(square=square, ball=ball, shift=shift, describe=describe)
