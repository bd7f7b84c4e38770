# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene says of its picture, and what the preferences say of the command."""

import bpy

from .command_line import Settings
from .find_command import find_command


class LippmannSettings(bpy.types.PropertyGroup):
    """Settings of a scene."""

    display: bpy.props.StringProperty(
        name="Display", description="A name that 'lippmann displays' tells, or a file", default="looking-glass-portrait"
    )
    by_camera: bpy.props.BoolProperty(
        name="As the camera looks",
        description="Place the display by the scene's camera; else the scene fills it",
        default=True,
    )
    quality: bpy.props.FloatProperty(
        name="Quality", description="PSNR (dB) to work for; 0: as many samples as below", default=0.0, min=0.0, max=80.0
    )
    samples: bpy.props.IntProperty(
        name="Samples", description="Samples in each pixel; 0: as the command likes", default=0, min=0, max=65536
    )
    output: bpy.props.StringProperty(
        name="Output", description="File of the native pixels", default="//lippmann.png", subtype="FILE_PATH"
    )

    def values(self) -> Settings:
        """The settings as plain values."""
        return Settings(self.display.strip(), self.by_camera, self.quality, self.samples)


class LippmannPreferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = __package__

    command: bpy.props.StringProperty(
        name="Command",
        description="The program lippmann, or its virtual environment; empty: looked for",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        """Draw the path, and what is found."""
        self.layout.prop(self, "command")
        found = find_command(self.command)
        self.layout.label(text=found or "not found: pip install lippmann", icon="CHECKMARK" if found else "ERROR")


def command_of(context) -> str | None:
    """The command's path by the preferences."""
    addon = context.preferences.addons.get(__package__)
    return find_command("" if addon is None else addon.preferences.command)
