"""Gaussian splats along rays: a hierarchy of their boxes, and exact compositing in the order of their peaks."""
