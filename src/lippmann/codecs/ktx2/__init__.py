"""Pictures in KTX 2.0 containers with Basis Universal texels, as KHR_texture_basisu of glTF has them.

- ``container``: headers, and which of the two kinds of texels the file holds.
- ``etc1s``: texels in ETC1S with BasisLZ, and ``huffman``, the codes that these are written in.
- ``uastc``: texels in UASTC.

Khronos' own package ``pyktx`` has no wheels: it needs its C library built and installed first.
"""

from lippmann.codecs.ktx2.container import IDENTIFIER, Ktx2Error, decode_ktx2

__all__ = ["IDENTIFIER", "Ktx2Error", "decode_ktx2"]
