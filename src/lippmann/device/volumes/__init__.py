"""Volumes along rays: emission and absorption by a transfer function, in steps of half a voxel."""
