"""The picture seen: by an eye (replay), by a camera (refocus), in videos, and as diagnostic maps."""
