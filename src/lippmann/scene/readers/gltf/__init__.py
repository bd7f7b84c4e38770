"""glTF 2.0 files (``.gltf``, ``.glb``) into plain scene values.

``document`` opens the file, ``json_fields`` checks its JSON as it is read, ``buffers`` and ``accessors`` turn bytes
into arrays, ``primitives`` arrays into triangles; ``reader`` walks the nodes and puts a scene together.
"""

from lippmann.scene.readers.gltf.reader import read_gltf

__all__ = ["read_gltf"]
