"""Error estimates: per-pixel errors, and the PSNR of a picture with its confidence interval."""
