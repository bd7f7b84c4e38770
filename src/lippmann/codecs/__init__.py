"""File formats of pixels: PNG, TIFF, OpenEXR, Zarr, PFM. Nothing here knows of displays."""
