"""The request: settings, the defaults that follow from the scene, and the region of interest."""
