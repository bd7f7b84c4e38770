# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the render properties."""

import bpy

from .operators import PREVIEW, Running
from .settings import command_of


class LIPPMANN_PT_panel(bpy.types.Panel):  # noqa: N801  # Blender's convention
    """Display, quality, output, and the buttons."""

    bl_label = "Lippmann"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    def draw(self, context):
        """Draw the panel."""
        layout, settings = self.layout, context.scene.lippmann
        layout.use_property_split = True
        if command_of(context) is None:
            layout.label(text="lippmann is not found: see the add-on's preferences", icon="ERROR")
        for name in ("display", "by_camera", "quality", "samples", "output"):
            layout.prop(settings, name)
        row = layout.row(align=True)
        row.operator("lippmann.preview", icon="HIDE_OFF")
        row.operator("lippmann.render", icon="RENDER_STILL")
        row.operator("lippmann.cancel", icon="X", text="")
        job = Running.job
        if job is not None:
            layout.progress(factor=job.share, text=f"{Running.kind}: {job.stage}")
        elif PREVIEW in bpy.data.images:
            layout.label(text=f"The image '{PREVIEW}' is for an image editor", icon="IMAGE_DATA")
