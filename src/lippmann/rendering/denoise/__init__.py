"""Denoising: Open Image Denoise, dual buffers, and the blends that keep the picture unbiased."""
