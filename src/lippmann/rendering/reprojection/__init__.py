"""Reprojection of traced points between micro-images, in the order of the 2014 paper and in a faster one."""
