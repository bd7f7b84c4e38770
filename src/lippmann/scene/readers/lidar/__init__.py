"""Scans by laser (LAS, LAZ), read by the library ``laspy`` in a process of its own."""
