"""Where the tests of the viewer find what they share."""

from __future__ import annotations

import sys
from pathlib import Path

# Modules that only these tests use lie beside them.
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "viewing"))
