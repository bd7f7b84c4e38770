"""Classic scenes on the device: tables of shapes, materials and light sources, and what a ray meets among them."""
