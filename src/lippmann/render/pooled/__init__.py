"""Light pooled in cells: gathered once in the scene, without a denoiser, and shared by all micro-images.

:class:`~lippmann.render.pooled.renderer.Pooled` drives it. Paths find the light at surfaces (``gathering``), which is
summed over the cells of a tree (``keys``, ``vertices``, ``pool``); every pixel then looks into the scene with samples
of its own (``looking``) and takes its light from there, times what the surface sends back of it (``surfaces``).
Mirrors, glass and sharp reflections are followed to what they show (``following``). What is shown in the end is the
best of pooled and unpooled light, region by region (``blending``).

Where a denoiser is at hand, ``--method pooled`` shares denoised light instead: :mod:`lippmann.render.sharing`.
"""
