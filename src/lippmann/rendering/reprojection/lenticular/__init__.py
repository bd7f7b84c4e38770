"""Reprojection under straight cylindrical lenses: forward warps of rows."""
