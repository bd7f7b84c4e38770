"""Animated glTF files: keyframes, and the scene at a given time."""
