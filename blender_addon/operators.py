# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: a preview, a render, and an end to them. Blender stays usable meanwhile."""

import shutil
import tempfile
import time
from pathlib import Path

import bpy

from .command_line import command_line, output_problem
from .in_blender.export import export_scene
from .job import Job
from .settings import command_of

#: Name of the picture of previews in Blender.
PREVIEW = "Lippmann preview"
#: Seconds between two looks at the command.
_INTERVAL = 0.2


class Running:
    """The job that runs, if any: one at a time."""

    job: Job | None = None
    kind: str = ""


class _Run(bpy.types.Operator):
    """What preview and render have in common."""

    kind = ""

    @classmethod
    def poll(cls, _context):
        return Running.job is None

    def execute(self, context):
        """Run to the end: in the background, and for scripts."""
        if not self._start(context):
            return {"CANCELLED"}
        while Running.job.status is None:
            time.sleep(_INTERVAL)
        return self._finish(context)

    def invoke(self, context, _event):
        """Run beside Blender's own work."""
        if bpy.app.background:
            return self.execute(context)
        if not self._start(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(_INTERVAL, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Look at the command now and then."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if Running.job is not None and Running.job.status is None:
            for area in context.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(context)

    def _start(self, context) -> bool:
        """Export the scene and start the command; what is wrong is reported."""
        program = command_of(context)
        if program is None:
            self.report({"ERROR"}, "the command lippmann is not found: install it, or name it in the preferences")
            return False
        settings = context.scene.lippmann
        self._folder = Path(tempfile.mkdtemp(prefix="lippmann-"))
        self._output = self._folder / "preview.png"
        if self.kind == "render":
            if settings.output.startswith("//") and not bpy.data.filepath:
                return self._refuse("save the Blender file first: the output lies beside it")
            self._output = Path(bpy.path.abspath(settings.output))
            problem = output_problem(self._output)
            if problem is not None:
                return self._refuse(problem)
        try:
            exported = export_scene(self._folder)
        except (AttributeError, RuntimeError, OSError) as error:  # the glTF exporter is an add-on, too
            return self._refuse(f"the scene cannot be exported: {' '.join(str(error).split())[-300:]}")
        for note in exported.notes:
            self.report({"INFO"}, note)
        words = command_line(
            program,
            self.kind,
            settings.values(),
            exported.scene,
            self._output,
            world=exported.world,
            camera=exported.camera,
            exposure=exported.exposure,
        )
        try:
            Running.job = Job(words)
        except OSError as error:
            return self._refuse(f"{program} cannot be run: {error.strerror or error}")
        Running.kind = self.kind
        return True

    def _refuse(self, why: str) -> bool:
        shutil.rmtree(self._folder, ignore_errors=True)
        self.report({"ERROR"}, why)
        return False

    def _finish(self, context):
        """Show the picture, or tell what went wrong."""
        job, Running.job = Running.job, None
        try:
            if job is None or job.is_cancelled:
                self.report({"INFO"}, "cancelled")
                return {"CANCELLED"}
            if job.status != 0:
                self.report({"ERROR"}, job.error)
                return {"CANCELLED"}
            self._show(context)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)
        return {"FINISHED"}

    def _show(self, context) -> None:
        raise NotImplementedError


class LIPPMANN_OT_preview(_Run):  # noqa: N801  # Blender's convention
    """Show what the display will show to an eye in front of its middle"""

    bl_idname = "lippmann.preview"
    bl_label = "Preview"
    kind = "preview"

    def _show(self, context) -> None:
        before = bpy.data.images.get(PREVIEW)
        image = bpy.data.images.load(str(self._output))
        image.pack()  # its file is gone in a moment
        if before is not None:
            before.user_remap(image)
            bpy.data.images.remove(before)
        image.name = PREVIEW
        _open_image(context, image)


class LIPPMANN_OT_render(_Run):  # noqa: N801
    """Render the native pixels of the display into the output file"""

    bl_idname = "lippmann.render"
    bl_label = "Render"
    kind = "render"

    def _show(self, _context) -> None:
        self.report({"INFO"}, f"rendered {self._output}")


class LIPPMANN_OT_cancel(bpy.types.Operator):  # noqa: N801
    """End the preview or render that runs"""

    bl_idname = "lippmann.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context):
        """Whether there is something to end."""
        return Running.job is not None

    def execute(self, _context):
        """End it."""
        Running.job.cancel()
        return {"FINISHED"}


def _open_image(context, image) -> None:
    """Show a picture in an image editor that is open."""
    if context.screen is None:
        return
    for area in context.screen.areas:
        if area.type == "IMAGE_EDITOR":
            area.spaces.active.image = image
            return


CLASSES = (LIPPMANN_OT_preview, LIPPMANN_OT_render, LIPPMANN_OT_cancel)
