"""The look of a ray-cast picture: light, sky, floor and shading, in linear colours."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

GAMMA = 2.2
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Look:
    """Light and colours of a picture; colours are sRGB in [0, 1].

    Attributes:
        light_w: direction from the scene to the key light; any length.
        light_size: radius of the key light over its distance; soft shadow edges.
        light_samples: shadow rays per point to the key light.
        sky_samples: rays per point to the sky dome; 0 gives no ambient occlusion.
        key: strength of the key light.
        ambient: strength of the light from the sky dome.
        gloss: strength of highlights on the hand (the floor has none).
        horizon: colour of the sky at the horizon, into which the floor fades.
        zenith: colour of the sky overhead.
        tiles: the two colours of the floor.
        tile_m: edge of a floor tile [m].
        fade_m: distance from `lookat_w` at which the floor has faded by 63 % [m].
        groups: geom groups to draw, as in MuJoCo's viewer.
    """

    light_w: tuple[float, float, float] = (-0.45, -0.55, 1.0)
    light_size: float = 0.10
    light_samples: int = 1
    sky_samples: int = 0
    key: float = 0.95
    ambient: float = 0.42
    gloss: float = 0.22
    horizon: Colour = (0.93, 0.945, 0.96)
    zenith: Colour = (0.60, 0.70, 0.82)
    tiles: tuple[Colour, Colour] = ((0.80, 0.815, 0.83), (0.69, 0.71, 0.735))
    tile_m: float = 0.05
    fade_m: float = 0.9
    groups: tuple[int, ...] = (0, 1, 2)


def linear(colour: object) -> Float[np.ndarray, "..."]:
    """Returns sRGB values c in [0, 1] as linear light [1]: L = c^2.2.

    Source:
        Ours; the power law close to the curve of IEC 61966-2-1.
    """
    return np.asarray(colour, np.float32) ** GAMMA


def encode(light: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns linear light L [1] as sRGB in [0, 255]: c = 255 · min(L₊, 1)^(1 / 2.2).

    Source:
        Ours; the inverse of `linear`, saturated.
    """
    return 255.0 * np.clip(light, 0.0, 1.0) ** (1 / GAMMA)


def sky(look: Look, rays_w: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns the background in linear light [1] along unit directions d.

    (1 − s) · horizon + s · zenith with s = (d_z)₊^0.6.

    Source:
        Ours; a gradient that is steep near the horizon, as a clear sky's.
    """
    height = np.clip(rays_w[:, 2:], 0.0, 1.0) ** 0.6
    return (1 - height) * linear(look.horizon) + height * linear(look.zenith)


def checkerboard(
    look: Look, points_w: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """Returns the floor's colour in linear light [1] at points of the world [m].

    Tile (⌊x / tile_m⌋ + ⌊y / tile_m⌋) mod 2 = 0 has the first colour.

    Source:
        Ours; steps of the hand can be counted in tiles.
    """
    cells = np.floor(points_w[:, :2] / look.tile_m)
    odd = (cells.sum(axis=1) % 2).astype(int)
    return linear(look.tiles)[odd]


def fade(
    look: Look,
    light: Float[np.ndarray, "n 3"],
    far_m: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    """Mixes linear light [1] with the horizon: weight exp(−(far / fade_m)²).

    Args:
        look: has the horizon's colour and `fade_m` [m].
        light: of the surface.
        far_m: distance from what the camera looks at [m].

    Source:
        Ours; the squared-exponential fog of OpenGL 1 (GL_EXP2).
    """
    weight = np.exp(-np.square(far_m / look.fade_m))[:, None]
    return weight * light + (1 - weight) * linear(look.horizon)


@dataclass(frozen=True)
class Surface:
    """What rays have met, point by point.

    Attributes:
        albedo: linear colours.
        gloss: strength of highlights.
        normals_w: unit normals.
    """

    albedo: Float[np.ndarray, "n 3"]
    gloss: Float[np.ndarray, " n"]
    normals_w: Float[np.ndarray, "n 3"]


def lit(
    look: Look,
    surface: Surface,
    rays_w: Float[np.ndarray, "n 3"],
    key_seen: Float[np.ndarray, " n"],
    sky_seen: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    """Returns the linear light [1] that leaves surfaces towards the camera.

    L = albedo · (ambient · sky_seen · (0.65 + 0.35 n_z) + key · key_seen · (n·l)₊)
    + gloss · (key_seen · (n·h)₊⁴⁰ + 0.35 (1 - n·v)³ · sky_seen), the last two terms a
    Blinn-Phong highlight with half vector h and a rim of sky light.

    Args:
        look: strengths of the lights.
        surface: what is lit.
        rays_w: unit directions from the camera.
        key_seen: visible fraction of the key light, 0 in full shadow.
        sky_seen: visible fraction of the sky dome.

    Source:
        J. F. Blinn, Models of Light Reflection for Computer Synthesized Pictures,
        SIGGRAPH 1977, for (n·h)₊; strengths and rim are ours.
    """
    normals_w = surface.normals_w
    toward = unit(np.asarray(look.light_w))
    facing = np.clip(normals_w @ toward, 0.0, None)
    dome = look.ambient * sky_seen * (0.65 + 0.35 * normals_w[:, 2])
    diffuse = surface.albedo * (dome + look.key * key_seen * facing)[:, None]
    half = unit(toward - rays_w)
    shine = key_seen * _positive_dot(normals_w, half) ** 40
    rim = 0.35 * (1 - _positive_dot(normals_w, -rays_w)) ** 3 * sky_seen
    return diffuse + (surface.gloss * (shine + rim))[:, None]


def unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Returns vectors scaled to length one: v / ‖v‖ [1].

    Source:
        Ours; zero vectors are the caller's fault and give NaN.
    """
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def rough(
    colours: Float[np.ndarray, "h w 3"], step: float = 10.0
) -> Bool[np.ndarray, "h w"]:
    """Marks pixels that differ from a neighbour: ‖c − c'‖∞ > step, sRGB of 255 [1].

    Source:
        Ours; only these are sampled more finely.
    """
    marked = np.zeros(colours.shape[:2], bool)
    across = np.abs(np.diff(colours, axis=1)).max(axis=2) > step
    down = np.abs(np.diff(colours, axis=0)).max(axis=2) > step
    marked[:, 1:] |= across
    marked[:, :-1] |= across
    marked[1:] |= down
    marked[:-1] |= down
    return marked


def _positive_dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.clip(np.einsum("ni,ni->n", a, b), 0.0, 1.0)
