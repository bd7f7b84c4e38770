"""Readers of Gaussian splats: PLY as trainers write it and as SuperSplat packs it, SPZ and SOG."""
