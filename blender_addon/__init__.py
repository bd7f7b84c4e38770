# SPDX-License-Identifier: GPL-3.0-or-later
"""Lippmann in Blender: previews and native pictures for integral-imaging displays, by the command ``lippmann``."""

import bpy

from .operators import CLASSES, Running
from .panel import LIPPMANN_PT_panel
from .settings import LippmannPreferences, LippmannSettings

_ALL = (LippmannSettings, LippmannPreferences, *CLASSES, LIPPMANN_PT_panel)


def register():
    """Add the classes, and the settings of scenes."""
    for each in _ALL:
        bpy.utils.register_class(each)
    bpy.types.Scene.lippmann = bpy.props.PointerProperty(type=LippmannSettings)


def unregister():
    """Take them away; a command that runs ends."""
    if Running.job is not None:
        Running.job.close()
        Running.job = None
    del bpy.types.Scene.lippmann
    for each in reversed(_ALL):
        bpy.utils.unregister_class(each)
