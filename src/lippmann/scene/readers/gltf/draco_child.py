"""The process that decodes Draco: a native decoder that damaged data may bring down, with nothing else in it.

Its argument is the number of bytes that it may take. Reads from standard input, and writes to standard output one
``.npz`` of all results.
"""

from __future__ import annotations

import io
import struct
import sys

import numpy as np
from numpy.typing import NDArray

#: Before each block of compressed data: its number and its length.
HEADER = struct.Struct("<QQ")


def main() -> None:
    """Decode all blocks: ``N/faces`` and ``N/ID`` hold triangles and attributes of block N, or ``N/error`` a reason."""
    _limit_memory(int(sys.argv[1]))
    import DracoPy  # type: ignore[import-not-found, unused-ignore]  # it has no types

    arrays: dict[str, NDArray[np.generic]] = {}
    given = sys.stdin.buffer
    while header := given.read(HEADER.size):
        number, length = HEADER.unpack(header)
        try:
            mesh = DracoPy.decode(given.read(length))
            arrays[f"{number}/faces"] = np.asarray(mesh.faces, np.uint32)
            for attribute in mesh.attributes:
                arrays[f"{number}/{attribute['unique_id']}"] = np.atleast_2d(attribute["data"])
        except (RuntimeError, ValueError, TypeError, MemoryError, DracoPy.FileTypeException) as error:
            arrays[f"{number}/error"] = np.array(" ".join(str(error).split())[:200] or type(error).__name__)
    written = io.BytesIO()
    np.savez(written, **arrays)  # type: ignore[arg-type]  # names are free
    sys.stdout.buffer.write(written.getvalue())


def _limit_memory(most: int) -> None:
    try:
        import resource
    except ImportError:  # there is none on Windows
        return
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))


if __name__ == "__main__":
    main()
