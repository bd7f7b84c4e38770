"""Molecules, read by the library ``gemmi`` in a process of its own."""
