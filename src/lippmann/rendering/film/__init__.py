"""Wavefronts of samples, sample batches, feature buffers, and AOVs."""
