"""Parts that all reprojection methods share: point images, gaps, thresholds, schedules."""
