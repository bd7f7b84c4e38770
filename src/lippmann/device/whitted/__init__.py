"""Classic scenes on the device: tables of shapes, materials and lamps, and what a ray meets among them."""
