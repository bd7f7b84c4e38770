"""Using traced points again: from micro-image to micro-image, as the 2014 paper does, and faster."""
