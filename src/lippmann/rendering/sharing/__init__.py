"""Joint filters across micro-images (after denoising) and across views of a quilt (before it)."""
