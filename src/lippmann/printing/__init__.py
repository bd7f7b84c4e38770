"""What a print behind a lens sheet needs beside its picture: a pitch test, and marks for laying the sheet."""

from lippmann.printing.marks import Marks, with_marks
from lippmann.printing.pitch_test import PitchTest

__all__ = ["Marks", "PitchTest", "with_marks"]
