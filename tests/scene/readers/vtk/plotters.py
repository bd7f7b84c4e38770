"""Plotters whose pictures are known from VTK itself: python plotters.py FILE writes these, 96 x 72, by name."""

import sys

import numpy as np
import pyvista

SIZE = (96, 72)


def board(values, **options):
    plane = pyvista.Plane(i_size=4, j_size=4, i_resolution=4, j_resolution=4)
    plane.clear_data()
    plane.cell_data["v"] = values
    return plane, {"scalars": "v", **options}


def blocks():
    near, far = pyvista.Plane(i_size=2, j_size=2), pyvista.Cube(center=(2.0, 0.5, 0.0))
    return pyvista.MultiBlock(
        {"near": near, "empty": None, "group": pyvista.MultiBlock([far, pyvista.Disc(outer=0.4)])}
    )


def shown(name):
    """What ``add_mesh`` gets."""
    numbers = np.arange(16.0)
    holes = np.where(np.isin(numbers, [5, 6, 9, 10]), np.nan, numbers)
    if name == "nan_opacity":
        return board(holes, nan_opacity=0.0)
    if name == "nan_color":
        return board(holes, nan_color="red")
    if name == "beyond":
        return board(numbers, clim=(4, 11), below_color="red", above_color="white")
    if name == "opacity":
        return board(numbers, opacity=np.where(np.isnan(holes), 0.0, 1.0))
    if name == "log":
        return board(numbers + 1, log_scale=True, cmap="plasma")
    if name == "points":
        plane = pyvista.Plane(i_size=4, j_size=4, i_resolution=3, j_resolution=3)
        plane.point_data["v"] = np.where(np.arange(16) == 3, np.nan, np.arange(16.0) ** 2)
        return plane, {"scalars": "v", "clim": (20, 180), "below_color": "red", "nan_color": "white"}
    if name == "texture":
        picture = np.zeros((2, 2, 3), np.uint8)
        picture[0, 0], picture[0, 1], picture[1, 0] = (255, 0, 0), (0, 255, 0), (0, 0, 255)
        texture = pyvista.Texture(picture)
        texture.interpolate = False
        return pyvista.Plane(i_size=4, j_size=4), {"texture": texture}
    if name == "blocks":
        return blocks(), {"color": "orange"}
    if name == "blocks by scalars":
        far = pyvista.Plane(center=(2.5, 0, 0), i_size=2, j_size=2, i_resolution=2, j_resolution=1)
        near = pyvista.Plane(i_size=2, j_size=2, i_resolution=2, j_resolution=1)
        far.cell_data["v"], near.cell_data["v"] = [0.0, 1.0], [2.0, 3.0]
        return pyvista.MultiBlock([far, near]), {"scalars": "v"}
    raise KeyError(name)


NAMES = ["nan_opacity", "nan_color", "beyond", "opacity", "log", "points", "texture", "blocks", "blocks by scalars"]


def make(name):
    """A plotter, unlit and before black, as a camera sees it that looks at its middle from far."""
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    plotter.set_background("black")
    plotter.disable_anti_aliasing()
    mesh, options = shown(name)
    if name == "blocks":
        _, mapper = plotter.add_composite(mesh, lighting=False, **options)
        mapper.block_attr[1].color = "blue"
        mapper.block_attr[5].visible = False
    else:
        plotter.add_mesh(mesh, lighting=False, show_scalar_bar=False, **options)
    plotter.camera_position = [(1.3, 1.7, 8.0), (0.6, 0.2, 0.0), (0.1, 1.0, 0.0)]
    if name == "beyond":
        plotter.camera.SetWindowCenter(0.25, -0.125)
    return plotter


if __name__ == "__main__":
    np.savez(sys.argv[1], **{name: make(name).screenshot(return_img=True) for name in NAMES})
