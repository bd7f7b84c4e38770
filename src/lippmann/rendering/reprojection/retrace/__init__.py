"""The careful mode: pixels that reprojection may have falsified are found and traced again."""
