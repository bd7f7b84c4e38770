"""Moving scenes: one integral image a frame, in files, resumable."""
