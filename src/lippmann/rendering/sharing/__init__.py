"""Denoised light shared across lenses and across views."""
