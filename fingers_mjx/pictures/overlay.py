"""Lines, dots, areas and labels at points of the world, drawn over a picture."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

from fingers_mjx.pictures.camera import Camera, project

Rgb = tuple[int, int, int]
AXIS_COLOURS: tuple[Rgb, ...] = ((214, 39, 40), (44, 140, 60), (31, 90, 190))
SMOOTH = 3
TEXT_PX = 14


@dataclass(frozen=True)
class Line:
    """A polyline through points of the world [m].

    Attributes:
        points_w: at least two points.
        colour: red, green, blue in [0, 255].
        width_px: in pixels of the picture.
        opacity: 1 hides what is behind.
    """

    points_w: Float[np.ndarray, "n 3"]
    colour: Rgb = (30, 30, 30)
    width_px: float = 2.0
    opacity: float = 1.0


@dataclass(frozen=True)
class Area:
    """A filled polygon with an outline, such as a support polygon."""

    points_w: Float[np.ndarray, "n 3"]
    colour: Rgb = (0, 114, 178)
    opacity: float = 0.25


@dataclass(frozen=True)
class Dots:
    """Filled discs of equal size on the picture."""

    points_w: Float[np.ndarray, "n 3"]
    colour: Rgb = (30, 30, 30)
    radius_px: float = 4.0


@dataclass(frozen=True)
class Label:
    """A line of text to the right of a point of the world."""

    point_w: Float[np.ndarray, "3"]
    text: str
    colour: Rgb = (30, 30, 30)


Item = Line | Area | Dots | Label


def draw(
    image: UInt8[np.ndarray, "h w 3"], camera: Camera, items: Iterable[Item]
) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a copy of `image` with `items` drawn in order, smooth at the edges.

    What lies behind the camera is left out; nothing is hidden by the scene.

    Args:
        image: a picture that `camera` took.
        camera: the point of view of that picture.
        items: what to draw.
    """
    picture = Image.fromarray(image).convert("RGBA")
    size = picture.size
    for item in items:
        layer = Image.new("RGBA", (size[0] * SMOOTH, size[1] * SMOOTH), (0, 0, 0, 0))
        _draw_item(ImageDraw.Draw(layer), camera, size, item)
        picture.alpha_composite(_shrunk(layer, size))
    return np.asarray(picture.convert("RGB")).copy()


def frame_axes(
    origin_w: Float[np.ndarray, "3"],
    rotation_w: Float[np.ndarray, "3 3"],
    length_m: float = 0.05,
    names: Sequence[str] = ("x", "y", "z"),
) -> list[Item]:
    """Returns red, green and blue axes of a frame, with names at their ends.

    Axis i ends at p_i = o + length · R e_i [m].

    Args:
        origin_w: origin of the frame [m, world].
        rotation_w: columns are the frame's axes in the world.
        length_m: length of the axes.
        names: labels of the three axes.

    Source:
        Ours; colours as in MuJoCo's viewer.
    """
    ends = origin_w + length_m * rotation_w.T
    items: list[Item] = []
    for end, colour, name in zip(ends, AXIS_COLOURS, names, strict=True):
        items.append(Line(np.stack([origin_w, end]), colour, width_px=3.0))
        items.append(Label(end, name, colour))
    return items


def caption(
    image: UInt8[np.ndarray, "h w 3"], text: str, colour: Rgb = (40, 45, 52)
) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a copy of `image` with a line of text in the upper left corner."""
    picture = Image.fromarray(image)
    size = max(11, image.shape[0] // 26)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(picture).text((size * 0.7, size * 0.6), text, colour, font)
    return np.asarray(picture).copy()


def _draw_item(
    pen: ImageDraw.ImageDraw, camera: Camera, size: tuple[int, int], item: Item
) -> None:
    points = item.point_w[None] if isinstance(item, Label) else item.points_w
    pixels = SMOOTH * project(camera, size, points)[0]
    if isinstance(item, Label):
        _text(pen, pixels[0], item)
    elif isinstance(item, Dots):
        _discs(pen, pixels, item)
    elif isinstance(item, Line):
        _polyline(pen, pixels, item)
    elif np.isfinite(pixels).all():
        shape = [tuple(p) for p in pixels]
        pen.polygon(shape, fill=(*item.colour, round(255 * item.opacity)))
        pen.line([*shape, shape[0]], fill=(*item.colour, 255), width=2 * SMOOTH)


def _polyline(pen: ImageDraw.ImageDraw, pixels: np.ndarray, item: Line) -> None:
    fill = (*item.colour, round(255 * item.opacity))
    width = max(1, round(item.width_px * SMOOTH))
    for run in _visible_runs(pixels):
        pen.line([tuple(p) for p in run], fill=fill, width=width, joint="curve")


def _visible_runs(pixels: np.ndarray) -> Iterator[np.ndarray]:
    visible = np.isfinite(pixels).all(axis=1)
    starts = np.flatnonzero(np.diff(visible.astype(int))) + 1
    for run in np.split(pixels, starts):
        if len(run) > 1 and np.isfinite(run).all():
            yield run


def _discs(pen: ImageDraw.ImageDraw, pixels: np.ndarray, item: Dots) -> None:
    radius = item.radius_px * SMOOTH
    for u, v in pixels[np.isfinite(pixels).all(axis=1)]:
        box = (u - radius, v - radius, u + radius, v + radius)
        pen.ellipse(box, fill=(*item.colour, 255))


def _text(pen: ImageDraw.ImageDraw, pixel: np.ndarray, item: Label) -> None:
    if np.isfinite(pixel).all():
        font = ImageFont.load_default(TEXT_PX * SMOOTH)
        place = (pixel[0] + 5 * SMOOTH, pixel[1] - 0.6 * TEXT_PX * SMOOTH)
        pen.text(place, item.text, (*item.colour, 255), font)


def _shrunk(layer: Image.Image, size: tuple[int, int]) -> Image.Image:
    """Shrinks with colour weighted by opacity, which Pillow does for "RGBa"."""
    small = layer.convert("RGBa").resize(size, Image.Resampling.BOX)
    return small.convert("RGBA")
