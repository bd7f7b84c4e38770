"""Readers of volumes: NIfTI, DICOM series, arrays of NumPy, and grids of Mitsuba's."""
