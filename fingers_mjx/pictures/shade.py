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
    """Returns sRGB values as linear light (power law, exponent 2.2)."""
    return np.asarray(colour, np.float32) ** GAMMA


def encode(light: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns linear light as sRGB values in [0, 255], saturated."""
    return 255.0 * np.clip(light, 0.0, 1.0) ** (1 / GAMMA)


def sky(look: Look, rays_w: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns the background: from the horizon's colour to the zenith's."""
    height = np.clip(rays_w[:, 2:], 0.0, 1.0) ** 0.6
    return (1 - height) * linear(look.horizon) + height * linear(look.zenith)


def checkerboard(
    look: Look, points_w: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """Returns the floor's colour at points of the world: tiles of `look.tile_m`."""
    cells = np.floor(points_w[:, :2] / look.tile_m)
    odd = (cells.sum(axis=1) % 2).astype(int)
    return linear(look.tiles)[odd]


def fade(
    look: Look,
    light: Float[np.ndarray, "n 3"],
    far_m: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    """Mixes `light` with the horizon: weight exp(-(far / fade_m)²)."""
    weight = np.exp(-np.square(far_m / look.fade_m))[:, None]
    return weight * light + (1 - weight) * linear(look.horizon)


def lit(
    look: Look,
    albedo: Float[np.ndarray, "n 3"],
    gloss: Float[np.ndarray, " n"],
    normals_w: Float[np.ndarray, "n 3"],
    rays_w: Float[np.ndarray, "n 3"],
    key_seen: Float[np.ndarray, " n"],
    sky_seen: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    """Returns the light that leaves surfaces towards the camera.

    albedo · (ambient · sky_seen · (0.65 + 0.35 n_z) + key · key_seen · (n·l)₊)
    + gloss · (key_seen · (n·h)₊⁴⁰ + 0.35 (1 - n·v)³ · sky_seen), the last two terms a
    Blinn-Phong highlight with half vector h and a rim of sky light.

    Args:
        look: strengths of the lights.
        albedo: linear colours of the surfaces.
        gloss: highlight strength per point.
        normals_w: unit normals.
        rays_w: unit directions from the camera.
        key_seen: visible fraction of the key light, 0 in full shadow.
        sky_seen: visible fraction of the sky dome.
    """
    toward = unit(np.asarray(look.light_w))
    facing = np.clip(normals_w @ toward, 0.0, None)
    dome = look.ambient * sky_seen * (0.65 + 0.35 * normals_w[:, 2])
    diffuse = albedo * (dome + look.key * key_seen * facing)[:, None]
    half = unit(toward - rays_w)
    shine = key_seen * _positive_dot(normals_w, half) ** 40
    rim = 0.35 * (1 - _positive_dot(normals_w, -rays_w)) ** 3 * sky_seen
    return diffuse + (gloss * (shine + rim))[:, None]


def unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Returns vectors scaled to length one."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def rough(
    colours: Float[np.ndarray, "h w 3"], step: float = 10.0
) -> Bool[np.ndarray, "h w"]:
    """Marks pixels that differ from a neighbour by more than `step` of 255."""
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
