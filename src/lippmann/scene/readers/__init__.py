"""Readers of scene files, one per format, and of objects of other libraries."""
