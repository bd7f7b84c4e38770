"""The recipe of a render: from a scene and a display to a picture, a quilt, or a forecast."""
