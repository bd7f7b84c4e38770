"""Volumes as a whole: checked, moved, cropped, and the transfer functions that show them."""
