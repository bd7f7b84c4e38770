"""A scene made into Mitsuba's: the one place where scenes meet the renderer."""

from lippmann.device.pbr.scene import BuiltScene, build, build_description

__all__ = ["BuiltScene", "build", "build_description"]
