"""Scenes as plain values: meshes, materials, lights, cameras, and the Whitted-style form. Nothing is parsed."""
