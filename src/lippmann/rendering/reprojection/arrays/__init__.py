"""Reprojection under lens arrays of any layout: backward warps along epipolar lines."""
