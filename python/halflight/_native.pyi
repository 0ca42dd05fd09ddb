"""
The module `halflight._native`.
"""

from _typeshed import Incomplete, SupportsGetItem, SupportsLenAndGetItem
from os import PathLike
from pathlib import Path
from typing import SupportsFloat, SupportsIndex, final

@final
class Audited:
    """
    What is told of a picture: `halflight.Audit`.
    """
    def answers(self, /) -> tuple[bool, bool | None]:
        """
        Whether the error is as well known as was asked, and whether it is at most what was asked about.
        """
    def causes(self, /) -> list[tuple[str, list[tuple[float, float]], float]]:
        """
        What would explain the error.
        """
    def error(self, /) -> tuple[tuple[float, float], tuple[float, float]]:
        """
        The relative RMS error and its square, each with its standard error.
        """
    def maps(self, /) -> list[Incomplete]:
        """
        The signed map, that of RMS errors, the estimate, its standard error, and the mask.
        """
    def mean(self, /) -> tuple[tuple[float, float], list[tuple[float, float] | None]]:
        """
        The mean error of all channels, and of each.
        """
    def parts(self, /) -> list[tuple[tuple[int, int], tuple[int, int], float, tuple[float, float]]]:
        """
        Parts of the picture: columns, rows, share of the squared error, mean error.
        """
    def taken(self, /) -> tuple[float, int, float, float, int, list[float]]:
        """
        Effective pixels, pixels that count, RMS of the scene, samples a pixel, rays, and seconds of both parts.
        """

@final
class Baked:
    """
    Maps of a scene: `halflight.LightMaps`.
    """
    def coverage(self, /) -> Incomplete:
        """
        The share of each texel that shows something.
        """
    def errors(self, /) -> list[tuple[float, float]]:
        """
        RMS irradiance, W/m², and estimated relative error: of all light, then of the luminaires.
        """
    def luminaires(self, /) -> list[str]:
        """
        Names of the luminaires that are kept apart.
        """
    def map(self, /, lamp: SupportsIndex | None = None) -> tuple[Incomplete, Incomplete]:
        """
        Irradiance, and its standard error, W/m²: of all light, or of luminaire number `lamp`.
        """
    def save(self, /, folder: str | PathLike[str], name: str, errors: bool) -> list[Path]:
        """
        Writes what the program's `bake` writes into a folder; returns the files.
        """
    def taken(self, /) -> tuple[float, int, int, float, bool]:
        """
        Texels a unit of the file, patches, rays and seconds; and whether the error is at most the tolerance.
        """
    def uv(self, /) -> Incomplete:
        """
        Where the corners of every face lie in the map, shares of its sides from the upper left.
        """
    def why(self, /) -> str | None:
        """
        Why the error is above the tolerance.
        """

@final
class Between:
    """
    Form factors between patches: `halflight.PatchFactors`.
    """
    def areas(self, /) -> Incomplete:
        """
        Areas, the file's units squared.
        """
    def factors(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Columns and values of F, row by row.
        """
    def objects(self, /) -> Incomplete:
        """
        The object of each patch.
        """
    def places(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Middles in the file's units, NaN for halves of the sky; and unit normals.
        """
    def shares(self, /) -> list[Incomplete]:
        """
        Share of each patch's rays that reach the sky, what is missing of 1 in its row, and its residual of reciprocity.
        """
    def solid(self, /) -> int:
        """
        Number of patches that are no sky's, which come last.
        """
    def starts(self, /) -> Incomplete:
        """
        Where the rows of F begin, and their end.
        """
    def taken(self, /) -> tuple[float, int]:
        """
        The residual of reciprocity of all rows together, and rays cast.
        """

@final
class Daylit:
    """
    Daylight at points: `halflight.Daylight`.
    """
    def coefficients(self, /) -> tuple[Incomplete, Incomplete]:
        """
        D and its standard error, points × columns × channels, sr.
        """
    def columns(self, /) -> list[Incomplete]:
        """
        Altitude and azimuth of the middles of the columns, radians, and their solid angles, sr.
        """
    def direct(self, /) -> tuple[Incomplete, Incomplete]:
        """
        The direct part and its error, points × columns, sr.
        """
    def illuminance(self, /) -> list[Incomplete] | None:
        """
        Illuminance, and that straight from the sun, points × skies, lx.
        """
    def luminance(self, /) -> Incomplete | None:
        """
        Luminance of the skies' columns without the sun, skies × columns, cd/m².
        """
    def means(self, /) -> list[list[float]] | None:
        """
        Mean illuminance of each point, and its error, lx.
        """
    def points(self, /) -> list[tuple[float, float, list[float]]] | None:
        """
        Of each point autonomy, sunlit hours and the four shares of UDI.
        """
    def taken(self, /) -> tuple[float, bool, int, float]:
        """
        The error that the tolerance is held against, whether it is met, patches and seconds.
        """
    def times(self, /) -> list[tuple[int, int, float] | None]:
        """
        Month, day and hour of each sky; none of one without a time.
        """
    def year(self, /) -> tuple[float, float, float] | None:
        """
        sDA, ASE, and occupied hours.
        """

@final
class KeptLamps:
    """
    The light of each lamp as an earlier run left it.
    """
    def aimed(self, /, wanted: SupportsGetItem[int, SupportsFloat | SupportsIndex | None], given: dict[str, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]]) -> dict[str, list[float]]:
        """
        The factors given, and those of all other lamps that light points as wanted, lux.
        """
    def error(self, /, given: dict[str, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]]) -> float | None:
        """
        The estimated error of the picture with some factors, relative to it; none where those of its layers are not
        known.
        """
    def named(self, /, name: str) -> list[int]:
        """
        Numbers of the points of a name.
        """
    def names(self, /) -> list[str]:
        """
        The lamps.
        """
    def picture(self, /, given: dict[str, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]]) -> Incomplete | None:
        """
        The picture with some factors; none where no layers were kept.
        """
    def points(self, /) -> tuple[int, bool]:
        """
        How many points were measured, and whether with the light of each lamp.
        """
    def relit(self, /, given: dict[str, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]], wanted: SupportsGetItem[int, SupportsFloat | SupportsIndex | None] | None) -> tuple[dict[str, list[float]], list[tuple[str, list[float], list[float]]], list[tuple[str | None, list[float], list[float], float, bool]], list[float] | None]:
        """
        Factors of all lamps, powers and points with some factors; root mean square and largest difference to what is
        wanted.
        """

@final
class Lamps:
    """
    L of each luminaire.
    """
    def light(self, /) -> Incomplete:
        """
        L of each: (lamps, patches, 2, 3).
        """
    def rest(self, /) -> list[float]:
        """
        Proved bounds on the norm of what is missing of each.
        """
    def verdict(self, /) -> tuple[float, float, str]:
        """
        Bounds on the spectral radius, and the verdict.
        """

@final
class ObjectFactors:
    """
    Form factors between the objects of a scene: `halflight.Factors`.
    """
    def how(self, /) -> list[str]:
        """
        How each was found, row by row.
        """
    def matrix(self, /) -> tuple[Incomplete, Incomplete]:
        """
        `F_ij`, and their standard errors.
        """
    def names(self, /) -> tuple[list[str], list[str]]:
        """
        Names of the rows, and of the columns.
        """
    def reciprocity(self, /) -> Incomplete:
        """
        Residuals of reciprocity of each pair.
        """
    def rows(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Areas, the file's units squared, and what is missing of 1 in each row.
        """
    def unmet(self, /) -> int:
        """
        Form factors whose standard error exceeds the tolerance.
        """

@final
class Rendered:
    """
    A picture and what is known of it.
    """
    def backs(self, /) -> float:
        """
        Share of the camera's rays that met black backs.
        """
    def counts(self, /) -> tuple[int, int]:
        """
        Patches and rays.
        """
    def error(self, /) -> list[float]:
        """
        Noise of F, patches, truncation, gather pass, light as emitted, and all but that together.
        """
    def layer(self, /, k: SupportsIndex) -> tuple[Incomplete, Incomplete]:
        """
        Layer k, and its standard error.
        """
    def layers(self, /) -> list[str]:
        """
        Names of the layers.
        """
    def luminaires(self, /) -> list[tuple[str, list[float], list[float]]]:
        """
        Name of each luminaire, power emitted and power reflected per channel, W.
        """
    def picture(self, /) -> Incomplete:
        """
        Linear radiance.
        """
    def seconds(self, /) -> list[float]:
        """
        Seconds of each step: patches, form factors, solve, gather, and all together.
        """
    def standard_error(self, /) -> Incomplete:
        """
        Its standard error from the gather pass.
        """
    def unmet(self, /, tolerance: SupportsFloat | SupportsIndex) -> str | None:
        """
        Why the error is above a tolerance, if it is, and what helps.
        """
    def verdict(self, /) -> tuple[float, float, str]:
        """
        Bounds on the spectral radius, and the verdict.
        """

@final
class Scene:
    """
    A checked scene.
    """
    def camera(self, /) -> tuple[list[float], list[float], list[float], float]:
        """
        Position, target and up of the camera in the file's units, and its vertical field of view, degrees. The target
        is as far away as the middle of the scene, or half the scene's size where that is behind.
        """
    def cameras(self, /) -> list[str]:
        """
        Names of the file's cameras.
        """
    def face_material(self, /) -> Incomplete:
        """
        The material of each triangle.
        """
    def face_object(self, /) -> Incomplete:
        """
        The object of each triangle.
        """
    def faces(self, /) -> Incomplete:
        """
        Vertices of the triangles, counter-clockwise seen from the front.
        """
    def looked_at(self, /, position: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], target: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], up: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], vertical_fov: SupportsFloat | SupportsIndex) -> Scene:
        """
        The same from another camera.
        """
    def looked_through(self, /, name: str) -> Scene:
        """
        The same through a camera of its file.
        """
    def luminaires(self, /) -> list[str]:
        """
        Names of what emits, as light is kept apart by.
        """
    def materials(self, /) -> list[tuple[str, list[float], list[float], float | None, float | None, bool, bool]]:
        """
        Name, rho, emission, alpha, tau, whether two-sided, and whether its emission is seen, of each material.
        """
    @property
    def name(self, /) -> str: ...
    def objects(self, /) -> list[str]:
        """
        Names of the objects, without the sky's.
        """
    def require_emission(self, /) -> None:
        """
        Raises `SceneError` where nothing emits.
        """
    def to_bytes(self, /) -> bytes:
        """
        All of it.
        """
    def transport(self, /) -> tuple[float, float] | None:
        """
        (alpha, tau) that the file gives.
        """
    def under_patches(self, /, radiances: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]], up: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], north: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None) -> Scene | None:
        """
        The same under a sky of patches in Radiance's order; none where they are of another number, or north is along up.
        """
    def under_sky(self, /, upper: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], lower: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], up: SupportsLenAndGetItem[SupportsFloat | SupportsIndex]) -> Scene:
        """
        The same under another sky, which has no patch of the old one.
        """
    def vertices(self, /) -> Incomplete:
        """
        Corner points in the file's units, those of faces that have a place.
        """
    def warnings(self, /) -> list[str]:
        """
        What the reader left out, and what else a person should know.
        """
    def with_material(self, /, name: str, rho: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, emission: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, alpha: SupportsFloat | SupportsIndex | None = None, tau: SupportsFloat | SupportsIndex | None = None, two_sided: bool | None = None) -> Scene:
        """
        The same with other numbers of the material of a name; what is `None` stays.
        """

@final
class Sensed:
    """
    Irradiance at points: `halflight.Irradiance`.
    """
    def bounce(self, /, n: SupportsIndex) -> Incomplete:
        """
        Irradiance by light that was reflected n times.
        """
    def bounces(self, /) -> int:
        """
        Bounces that are kept apart.
        """
    def irradiance(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Irradiance, and its standard error, W/m².
        """
    def is_inside(self, /) -> list[bool]:
        """
        Whether each is inside of a solid.
        """
    def luminaire(self, /, name: str) -> Incomplete:
        """
        Irradiance by the light of one.
        """
    def luminaires(self, /) -> list[str]:
        """
        Names of the luminaires that are kept apart.
        """
    def taken(self, /) -> tuple[float, int, int, float]:
        """
        Share of the points whose error is at most the tolerance; patches, rays and seconds.
        """

@final
class Series:
    """
    A series that was summed, or some of its first terms.
    """
    def errors(self, /) -> list[float]:
        """
        Relative standard errors of the powers; empty where they are those of patches.
        """
    def figures(self, /) -> list[list[float]]:
        """
        Of each term: norm, ratio to the one before, and the proved bound on all later ones; NaN where there is none.
        """
    def kept(self, /) -> int:
        """
        How many terms are kept.
        """
    def left(self, /) -> Incomplete | None:
        """
        The proved bound on all that follows the last term, patch by patch; none where there is none.
        """
    def light(self, /) -> Incomplete:
        """
        `L`.
        """
    def luminaires(self, /) -> list[tuple[str, list[list[float]], list[float]]]:
        """
        Name, powers and relative errors of each luminaire's terms.
        """
    def powers(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Of each term: power of the visible half and of the invisible, W per channel.
        """
    def term(self, /, n: SupportsIndex) -> Incomplete:
        """
        `KⁿE`, of a term that is kept.
        """
    def truncation(self, /) -> float:
        """
        What the series left out at most, as a share of the reflected light.
        """
    def unmet(self, /) -> str | None:
        """
        What keeps them above the tolerance.
        """
    def verdict(self, /) -> tuple[float, float, str]:
        """
        Bounds on the spectral radius, and the verdict.
        """

@final
class System:
    """
    An equation.
    """
    def alpha(self, /) -> Incomplete:
        """
        Shares of what is reflected that travel on.
        """
    def apply(self, /, x: Incomplete) -> Incomplete:
        """
        `K x`.
        """
    def apply_columns(self, /, x: Incomplete) -> Incomplete:
        """
        `K x` of the columns of a matrix.
        """
    def apply_transposed(self, /, y: Incomplete) -> Incomplete:
        """
        `K^T y`.
        """
    def areas(self, /) -> Incomplete:
        """
        Areas, the file's units squared.
        """
    def emission(self, /) -> Incomplete:
        """
        `E`.
        """
    def factors(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Columns and values of F, row by row.
        """
    def first_bounce(self, /) -> Incomplete:
        """
        `K E`, luminaires by closed form.
        """
    def label(self, /) -> str:
        """
        The mode's name, or its numbers.
        """
    def luminaires(self, /) -> list[str]:
        """
        Names of the luminaires, where they are kept apart.
        """
    def materials(self, /) -> Incomplete:
        """
        Numbers of the materials.
        """
    def objects(self, /) -> Incomplete:
        """
        Numbers of the objects.
        """
    def patches(self, /) -> int:
        """
        Number of patches.
        """
    def places(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Middles in the file's units, NaN for halves of the sky; and unit normals.
        """
    def recipe(self, /) -> tuple[tuple[float, float], tuple[int, int], int, bool]:
        """
        (alpha, tau), patches and rays requested, seed, whether luminaires are apart.
        """
    def rho(self, /) -> Incomplete:
        """
        Reflectances.
        """
    def row_sums(self, /) -> tuple[float, float, float] | None:
        """
        Mean, least and largest sum of the rows of F before anything was left out.
        """
    def scene(self, /) -> Scene:
        """
        The scene.
        """
    def starts(self, /) -> Incomplete:
        """
        Where the rows of F begin, and their end.
        """
    def triangles(self, /) -> tuple[Incomplete, Incomplete]:
        """
        Corners of the patches' triangles in the file's units, and the patch of each.
        """
    def wholes(self, /) -> Incomplete:
        """
        The patch, as it was cut, that each is a part of; itself where it was not divided.
        """

def assemble(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], fineness: tuple[SupportsIndex, SupportsIndex], luminaires: bool, asked: Incomplete) -> System:
    """
    Casts F and puts K together.
    """

def assemble_kept(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], fineness: tuple[SupportsIndex, SupportsIndex], luminaires: bool, factors: Incomplete, asked: Incomplete) -> System:
    """
    The same with rows of F that are known.
    """

def audit(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], picture: Incomplete, goal: Incomplete, asked: Incomplete) -> Audited:
    """
    Tells the error of a picture.
    """

def bake(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], effort: Incomplete, asked: Incomplete) -> Baked:
    """
    Bakes the light of a scene onto its surfaces.
    """

def bounces(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], count: SupportsIndex, aim: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex | None], luminaires: bool, asked: Incomplete) -> tuple[System, Series]:
    """
    The first bounces with their powers to a tolerance.
    """

def builtin_scenes() -> list[tuple[str, str]]:
    """
    The names of the built-in scenes, each with a line on it.
    """

def daylight(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], sensors: tuple[Incomplete, Incomplete], own: Incomplete, asked: Incomplete) -> Daylit:
    """
    Finds coefficients at points, positions and normals in the file's units, and what skies make of them.
    """

def dimmed(lit: Incomplete, wanted: SupportsGetItem[int, SupportsFloat | SupportsIndex]) -> list[float] | None:
    """
    The factors from 0 to 1 of lamps with the illuminances `lit` (points, lamps) that come nearest to `wanted`.
    """

def encode_png(picture: Incomplete, stops: SupportsFloat | SupportsIndex) -> bytes:
    """
    The bytes of a PNG file.
    """

def exchange(matrix: Incomplete, areas: SupportsGetItem[int, SupportsFloat | SupportsIndex], emissivities: SupportsGetItem[int, SupportsFloat | SupportsIndex]) -> tuple[list[Incomplete], list[list[float]]]:
    """
    What objects exchange by radiation: Gebhart's factors, conductances and the matrix of the net-radiation method, each
    n × columns; the sums of rows, and how far conductances are from those back.
    """

def explore(scene: Scene, file: str | PathLike[str], words: tuple[str, str, bool], effort: Incomplete, asked: Incomplete) -> tuple[list[int], float, float | None]:
    """
    Writes a page with a title and an attribution, and whether it opens with the story.
    """

def exposure_of(picture: Incomplete) -> float | None:
    """
    The stops at which a picture is shown well; none where all is dark.
    """

def first_terms(system: System, count: SupportsIndex, keep: SupportsIndex) -> Series:
    """
    The first bounces, whether the series converges or not, of which so many terms are kept.
    """

def lamps(system: System, truncation: SupportsFloat | SupportsIndex) -> Lamps:
    """
    L of each luminaire, over one K.
    """

def lux(irradiance: Incomplete) -> Incomplete:
    """
    Illuminance of irradiances.
    """

def object_factors(scene: Scene, tau: SupportsFloat | SupportsIndex, tolerance: SupportsFloat | SupportsIndex, asked: Incomplete) -> ObjectFactors:
    """
    Finds those between objects.
    """

def open_folder(folder: str | PathLike[str], asked: Incomplete) -> tuple[Scene, System, int | None]:
    """
    What a folder was solved for, made again from its F; the number of bounces is none where it has no light.
    """

def open_lamps(file: str | PathLike[str]) -> KeptLamps:
    """
    Reads what a run left: a report, or an EXR file with layers of lamps.
    """

def open_scene(scene: str, two_sided: bool, reflectance: SupportsFloat | SupportsIndex | None, light: str | None, highlights: bool, camera: str | None, unit: str | None, as_modelled: bool) -> Scene:
    """
    Reads a file, or a built-in scene, on another thread, so that signals are heard.
    """

def patch_factors(scene: Scene, tau: SupportsFloat | SupportsIndex, fineness: tuple[SupportsIndex, SupportsIndex], asked: Incomplete) -> Between:
    """
    Finds those between patches.
    """

def points(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], sensors: tuple[Incomplete, Incomplete], tolerance: SupportsFloat | SupportsIndex, luminaires: bool, asked: Incomplete) -> Sensed:
    """
    Measures light at points, positions and normals in the file's units.
    """

def read_picture(path: str | PathLike[str]) -> Incomplete:
    """
    Reads a picture.
    """

def render(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], size: tuple[SupportsIndex, SupportsIndex], effort: Incomplete, apart: tuple[bool, bool], asked: Incomplete) -> Rendered:
    """
    Renders a picture.
    """

def save_folder(system: System, series: Series, folder: str | PathLike[str], also: SupportsGetItem[int, str], asked: Incomplete) -> None:
    """
    Keeps F, L and all terms in a folder, as the program's `--save` does.
    """

def save_layers(path: str | PathLike[str], picture: Incomplete, layers: SupportsGetItem[int, tuple[str, Incomplete]], errors: SupportsGetItem[int, tuple[str, Incomplete]], stops: SupportsFloat | SupportsIndex) -> list[Path]:
    """
    Writes a picture with layers and standard errors of them (of the picture, where the name is empty): in an EXR file,
    or in files of their own beside it; returns the files.
    """

def save_picture(path: str | PathLike[str], picture: Incomplete, stops: SupportsFloat | SupportsIndex) -> None:
    """
    Writes a picture: `.exr` holds radiances, `.png` what the eye is to see of them.
    """

def scene_from_arrays(arrays: Incomplete) -> Scene:
    """
    Makes a scene.
    """

def scene_from_bytes(bytes: bytes) -> Scene:
    """
    The scene that [`Scene::to_bytes`] gave.
    """

def solution_picture(system: System, series: Series, scene: Scene, pixels: Incomplete, asked: Incomplete) -> tuple[Incomplete, Incomplete, int, float]:
    """
    A picture of a solution by the camera of a scene, with so many hemisphere rays a pixel.
    """

def srgb(picture: Incomplete, stops: SupportsFloat | SupportsIndex) -> Incomplete:
    """
    The sRGB codes that a PNG file has of a picture: (height, width, 3).
    """

def stability_map(scene: Scene, grid: SupportsIndex, patches: SupportsIndex, rays: SupportsIndex, asked: Incomplete) -> tuple[list[list[float]], list[list[float]], list[list[float]], list[list[float]], bool, tuple[int, int, int]]:
    """
    Maps a scene.
    """

def summed(system: System, truncation: SupportsFloat | SupportsIndex, keep: SupportsIndex) -> Series:
    """
    The sum of the series, of which so many terms are kept.
    """

def term_pictures(system: System, series: Series, count: SupportsIndex, scene: Scene, pixels: Incomplete, asked: Incomplete) -> list[Incomplete]:
    """
    A picture of E, and of each of the first bounces.
    """

def trace(scene: Scene, mode: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], size: tuple[SupportsIndex, SupportsIndex], tracing: Incomplete, asked: Incomplete) -> tuple[Incomplete, Incomplete | None, int, float | None, tuple[int, int, int], float]:
    """
    Traces paths: the picture, its standard error, samples a pixel, relative standard error; paths, rays and paths cut;
    and seconds.
    """

def __getattr__(name: str) -> Incomplete: ...
