"""A page that shows a picture as its display would: served on this machine, as one file, or in a notebook."""
