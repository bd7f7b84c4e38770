"""Live frames of a display: the native pixels that an eye sees, traced as in a render."""
