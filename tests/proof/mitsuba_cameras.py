"""Pictures that Mitsuba's own cameras take from where an eye is, at chosen points of the lens plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Millimetres in front of the lens plane at which orthographic cameras stand.
CAMERA_START = 100.0

#: How far (mm in the lens plane) a stable sample may be moved, and how far (mm) its surface point may jump then.
NUDGE, JUMP = 1e-4, 1e-2


def camera_rays(world_from_display, distance, viewpoint, points):
    """Rays of the Mitsuba camera at one viewpoint through ``points`` ``(n, 2)`` of the lens plane."""
    import drjit as dr
    import mitsuba as mi

    def in_world(point):
        return (world_from_display @ [*point, 1.0])[:3]

    unit = float(np.linalg.norm(world_from_display[:3, 0]))
    direction = np.array([0.0, 0.0, -1.0]) if math.isfinite(distance) else np.array([*-viewpoint, -1.0])
    direction /= np.linalg.norm(direction)
    origin = np.array([*viewpoint, distance]) if math.isfinite(distance) else -direction * CAMERA_START
    pose = mi.ScalarTransform4d().look_at(
        origin=in_world(origin), target=in_world(origin + direction), up=world_from_display[:3, 1] / unit
    )
    # The camera's picture: a square about the middle of its view that holds all points.
    right = np.cross(direction, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, direction)
    relative = np.concatenate([points, np.zeros((len(points), 1))], axis=1) - origin
    picture = np.stack([relative @ right, relative @ up], axis=-1)
    half = 1.1 * np.abs(picture).max()
    common = {
        "film": {"type": "hdrfilm", "width": 100, "height": 100, "rfilter": {"type": "box"}},
        "near_clip": unit,
        "far_clip": 1e3 * unit,
    }
    if math.isfinite(distance):
        fov = math.degrees(2 * math.atan(half / distance))
        sensor = mi.load_dict({"type": "perspective", "to_world": pose, "fov": fov, "fov_axis": "x", **common})
    else:
        pose = pose @ mi.ScalarTransform4d().scale([half * unit, half * unit, 1.0])
        sensor = mi.load_dict({"type": "orthographic", "to_world": pose, **common})
    film = 0.5 + 0.5 * picture / half * [1.0, -1.0]
    position = mi.Point2f(film[:, 0].astype(np.float32), film[:, 1].astype(np.float32))
    ray, _ = sensor.sample_ray(0.0, 0.5, position, mi.Point2f(0.5, 0.5))
    dr.eval(ray.o, ray.d)  # by one kernel, not one for each
    return tuple(np.broadcast_to(np.array(vector).T, (len(points), 3)) for vector in (ray.o, ray.d))


@dataclass
class Direct:
    """What the direct cameras see, ``(n, 3)`` each; positions (mm) and normals in the display's frame."""

    hit: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    emission: np.ndarray
    stable: np.ndarray
    cameras: int


def direct_pictures(built, world_from_display, sheet, samples):
    """The direct pictures' samples; one camera for each viewpoint that occurs."""
    nudges = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * NUDGE
    n = len(samples.points)
    origin, direction = np.zeros((5, n, 3)), np.zeros((5, n, 3))
    _, group = np.unique(np.round(samples.viewpoints, 6), axis=0, return_inverse=True)
    group = group.reshape(-1)
    for number in range(group.max() + 1):
        members = np.flatnonzero(group == number)
        viewpoint = samples.viewpoints[members].mean(axis=0)
        points = (samples.points[members] + nudges[:, None]).reshape(-1, 2)
        o, d = camera_rays(world_from_display, sheet.distance, viewpoint, points)
        origin[:, members], direction[:, members] = o.reshape(5, -1, 3), d.reshape(5, -1, 3)
    hit, position, normal, emission = intersect(built, origin.reshape(-1, 3), direction.reshape(-1, 3))
    position, normal = in_display(world_from_display, position, normal)
    hit, position = hit.reshape(5, n), position.reshape(5, n, 3)
    jump = np.abs(position - position[0]).max(axis=(0, 2))
    stable = (hit == hit[0]).all(axis=0) & (~hit[0] | (jump < JUMP))
    return Direct(hit[0], position[0], normal[:n], emission[:n], stable, int(group.max()) + 1)


def intersect(built, origin, direction):
    """Hit or not, point, shading normal and emitted light of the first surface, all by Mitsuba."""
    import drjit as dr
    import mitsuba as mi

    scene = built.mitsuba
    ray = mi.Ray3f(mi.Point3f(origin.T.astype(np.float32)), mi.Vector3f(direction.T.astype(np.float32)))
    si = scene.ray_intersect(ray)
    hit = si.is_valid()
    light = dr.select(hit, si.emitter(scene).eval(si), 0)
    values = dr.select(hit, si.p, 0), si.sh_frame.n, light
    dr.eval(hit, values)
    return (np.array(hit), *(np.array(value).T for value in values))


def in_display(world_from_display, position, normal):
    """World points and unit normals in the display's frame (mm)."""
    rotation_scale = world_from_display[:3, :3]
    unit = np.linalg.norm(rotation_scale[:, 0])
    position = (position - world_from_display[:3, 3]) @ rotation_scale / unit**2
    return position, normal @ rotation_scale / unit
