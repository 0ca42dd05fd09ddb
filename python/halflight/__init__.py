"""halflight solves the light transport equation ``L = E + K L`` for diffuse scenes with vector-valued light.

Light is a pair: an invisible half that travels, and a visible half that only the camera collects. Surfaces reflect by
``rho [[alpha, 0], [1, 0]]`` and let the share tau of light through; alpha and tau turn one algorithm into global,
shadowless, one-bounce and local illumination, and everything between.

======================================  =================================================================
:func:`load`, :class:`Scene`            a scene, from files or from arrays; :meth:`Scene.from_objects`
:func:`render`, :func:`trace`           its picture, to a stated error; the same by path tracing
:func:`solve`                           L on patches with every bounce apart, and K for SciPy's solvers
:func:`bounces`                         powers of the terms to a tolerance
:func:`points`                          irradiance and illuminance at points
:func:`factors`, :func:`patch_factors`  form factors between objects, and between patches
:func:`stability_map`                   where the series converges, over the (alpha, tau) square
:func:`relight`, :func:`explore`        lamps of other strengths without a ray; a page to play with
:func:`audit`                           the error of any picture, without a reference
:func:`bake`                            lightmaps, and a glTF file that uses them
:func:`daylight`                        daylight coefficients with errors, and a year's illuminance
:func:`open`                            what :meth:`Solution.save` kept
======================================  =================================================================

Lengths are in the scene's units, radiances in W/(m² sr), irradiances in W/m², powers in W; arrays of light are
(..., 2, 3): invisible and visible half; red, green, blue.
"""

from typing import TYPE_CHECKING, Any

from halflight._audit import Audit, audit
from halflight._bake import LightMaps, bake
from halflight._bounces import Bounce, Bounces
from halflight._camera import Camera
from halflight._daylight import Daylight, DaylightYear, daylight
from halflight._errors import (
    Diverges,
    DoesNotFit,
    FolderError,
    HalflightError,
    SceneError,
    SceneWarning,
    ToleranceWarning,
)
from halflight._explore import Page, explore
from halflight._factors import Exchange, Factors, PatchFactors, factors, patch_factors
from halflight._figures import plot_bounces, plot_map, to_pyvista
from halflight._images import exposure, read_picture, save_picture, srgb
from halflight._lamps import Lamps
from halflight._lights import PointLight, SpotLight, SunLight
from halflight._map import StabilityMap, stability_map
from halflight._materials import Material, Texture
from halflight._meshes import Mesh, box, quad
from halflight._native import __version__
from halflight._patches import Patches
from halflight._picture import Errors, Picture, Rendered, Seconds
from halflight._points import Irradiance, lux, points
from halflight._relight import Relit, relight
from halflight._render import render, trace
from halflight._scene import Scene, cornell_box, load, scenes
from halflight._solution import Solution
from halflight._solve import bounces, solve
from halflight._solve import open as open

if TYPE_CHECKING:
    from halflight._operator import Operator

__all__ = [
    "Audit",
    "Bounce",
    "Bounces",
    "Camera",
    "Daylight",
    "DaylightYear",
    "Diverges",
    "DoesNotFit",
    "Errors",
    "Exchange",
    "Factors",
    "FolderError",
    "HalflightError",
    "Irradiance",
    "Lamps",
    "LightMaps",
    "Material",
    "Mesh",
    "Operator",
    "Page",
    "PatchFactors",
    "Patches",
    "Picture",
    "PointLight",
    "Relit",
    "Rendered",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Seconds",
    "Solution",
    "SpotLight",
    "StabilityMap",
    "SunLight",
    "Texture",
    "ToleranceWarning",
    "__version__",
    "audit",
    "bake",
    "bounces",
    "box",
    "cornell_box",
    "daylight",
    "explore",
    "exposure",
    "factors",
    "load",
    "lux",
    "patch_factors",
    "plot_bounces",
    "plot_map",
    "points",
    "quad",
    "read_picture",
    "relight",
    "render",
    "save_picture",
    "scenes",
    "solve",
    "srgb",
    "stability_map",
    "to_pyvista",
    "trace",
]


def __getattr__(name: str) -> Any:
    # Its file imports SciPy, which takes longer than all else.
    if name == "Operator":
        from halflight._operator import Operator

        return Operator
    raise AttributeError(f"module 'halflight' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
