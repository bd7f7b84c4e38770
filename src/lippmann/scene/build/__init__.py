"""A scene made into Mitsuba's: the one place where scenes meet the renderer."""

from lippmann.scene.build.assembly import BuiltScene, build, build_description

__all__ = ["BuiltScene", "build", "build_description"]
