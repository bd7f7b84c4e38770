"""Data sets and plotters of PyVista as plain values.

PyVista is not imported here: whoever has an object of it has loaded it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from lippmann.scene.readers.vtk.data_set import describe_surface, image_of, surface_of, unshown_arrays
from lippmann.scene.readers.vtk.plotter import from_plotter
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import describe_volume

if TYPE_CHECKING:
    import pyvista

_UP_NOTE = "up is taken as +y, for nothing in the data says it (turn 0,-90 sets a model upright whose up is +z)"


def from_pyvista(source: pyvista.DataSet | pyvista.MultiBlock) -> SceneDescription:
    """A PyVista data set: of an image with active scalars the volume, else its surface, cut into triangles.

    See :mod:`lippmann.scene.readers.vtk.data_set`.

    Raises
    ------
    SceneError
        The data set has no surface.
    """
    image = image_of(source) if hasattr(source, "direction_matrix") else None
    if image is not None:
        return describe_volume("pyvista", *image, notes=[f"the scalars '{source.active_scalars_name}'"])
    surface = surface_of(source)
    notes = [_UP_NOTE, *surface.notes]
    if surface.colors is None and (names := unshown_arrays(source)):
        notes.append(f"none of its arrays is active in all of it, so that none is shown of {names}")
    return describe_surface(surface, "pyvista", notes)


def adapter_for(source: object) -> Callable[[Any], SceneDescription]:
    """The function that reads an object of PyVista's."""
    return from_plotter if hasattr(source, "renderers") else from_pyvista
