"""The sRGB transfer curve and its slope."""
