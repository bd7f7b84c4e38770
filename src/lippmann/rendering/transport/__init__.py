"""Light transport: ray sources, integrators, and light sampling."""
