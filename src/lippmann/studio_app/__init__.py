"""The studio: a display seen live while everything is set up by hand."""
