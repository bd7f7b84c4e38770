"""Frames of a display while it is set up: the native pixels that an eye sees, traced as a render would trace them."""
