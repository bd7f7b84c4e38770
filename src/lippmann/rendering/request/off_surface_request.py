"""What cannot be asked of scenes whose light lies on no surface: Gaussian splats and volumes."""

from __future__ import annotations

from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription


def check_off_surfaces(request: RenderRequest, scene: Scene) -> None:
    """Refuse what splats or a volume do not have.

    Raises
    ------
    UsageError
        It asks for a surface, light to be shared or denoised, or an exposure.
    """
    description, name = scene.description, scene.name
    assert isinstance(description, SceneDescription)
    alone = not description.placements
    what = "Gaussian splats" if scene.has_splats else "a volume"
    if request.method not in ("auto", "full"):
        raise UsageError(
            f"{request.method} shares the light of surfaces",
            where=name,
            parameter="method",
            rule=f"this scene has {what}, whose light lies on none",
            fix='use method="full"',
        )
    rule = f"this scene has {what}, and light that lies on none"
    for parameter, is_asked, why in (
        (
            "integrator",
            request.integrator not in ("auto", "path", "direct"),
            f"{request.integrator} is told of surfaces",
        ),
        ("layers", request.layers, "are told of surfaces"),
        ("denoise", request.denoise not in ("auto", "none"), f"{request.denoise} goes by the edges of surfaces"),
        ("caustics", request.caustics == "photons", "photons land on surfaces"),
    ):
        if is_asked:
            raise UsageError(why, where=name, parameter=parameter, rule=rule, fix="leave it out")
    if alone and request.exposure not in ("auto", 0.0):
        raise UsageError(
            f"{request.exposure:g}",
            where=name,
            parameter="exposure",
            rule=f"must be 0: the colours of {what} are made for displays, and are no amounts of light",
            fix="leave it out",
        )
