"""Light transport: ray sources, integrators, and light sampling.

Two rules of Dr.Jit shape the kernels:

- Dr.Jit takes the fields of dataclasses for loop state and writes them. So classes that a loop only reads are plain.
- State that no iteration changes makes Dr.Jit record a loop twice. So loops exclude such values (``dr.hint``), and keep
  a ray as origin and direction, without its time and wavelengths.
"""
