"""The part that runs inside Blender, by Blender's Python: a scene becomes a GLB file, a picture of its world, notes.

It imports ``bpy``, its own modules and nothing else, for Blender's Python knows nothing of Lippmann. The add-on for
Blender holds a copy of it.
"""
