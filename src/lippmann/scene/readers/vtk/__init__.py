"""Data of VTK: PyVista's data sets and plotters, and VTK's files."""
