"""What the tests of readers share: writers of files that no library writes."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
