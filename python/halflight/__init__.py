"""halflight solves the light transport equation ``L = E + K L`` for diffuse scenes with vector-valued light.

Light is a pair: an invisible half that travels, and a visible half that only the camera collects. Surfaces reflect by
``rho [[alpha, 0], [1, 0]]`` and let the share tau of light through; alpha and tau turn one algorithm into global,
shadowless, one-bounce and local illumination, and everything between.

======================================  =================================================================
:func:`load`, :class:`Scene`            a scene, from files or from arrays
:func:`render`, :func:`trace`           its picture, to a stated error; the same by path tracing
:func:`solve`                           L on patches with every bounce apart, and K for SciPy's solvers
:func:`bounces`                         powers of the terms to a tolerance
:func:`points`                          irradiance and illuminance at points
:func:`factors`, :func:`patch_factors`  form factors between objects, and between patches
:func:`stability_map`                   where the series converges, over the (alpha, tau) square
:func:`open`                            what :meth:`Solution.save` kept
======================================  =================================================================

Lengths are in the scene's units, radiances in W/(m² sr), irradiances in W/m², powers in W; arrays of light are
(..., 2, 3): invisible and visible half; red, green, blue.
"""

from halflight._errors import (
    Diverges,
    DoesNotFit,
    FolderError,
    HalflightError,
    SceneError,
    SceneWarning,
    ToleranceWarning,
)
from halflight._factors import Factors, PatchFactors, factors, patch_factors
from halflight._figures import plot_bounces, plot_map, to_pyvista
from halflight._map import StabilityMap, stability_map
from halflight._native import __version__
from halflight._operator import Operator, Patches
from halflight._picture import Errors, Picture, Seconds, read_picture, render, save_picture, trace
from halflight._points import Irradiance, lux, points
from halflight._scene import Camera, Material, Scene, cornell_box, load, scenes
from halflight._solution import Bounce, Bounces, Lamps, Solution, bounces, solve
from halflight._solution import open as open

__all__ = [
    "Bounce",
    "Bounces",
    "Camera",
    "Diverges",
    "DoesNotFit",
    "Errors",
    "Factors",
    "FolderError",
    "HalflightError",
    "Irradiance",
    "Lamps",
    "Material",
    "Operator",
    "PatchFactors",
    "Patches",
    "Picture",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Seconds",
    "Solution",
    "StabilityMap",
    "ToleranceWarning",
    "__version__",
    "bounces",
    "cornell_box",
    "factors",
    "load",
    "lux",
    "patch_factors",
    "plot_bounces",
    "plot_map",
    "points",
    "read_picture",
    "render",
    "save_picture",
    "scenes",
    "solve",
    "stability_map",
    "to_pyvista",
    "trace",
]
