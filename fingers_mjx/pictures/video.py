"""Videos: frames of a recorded motion, a camera that follows, mp4, GIF and WebP."""

import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import chain
from pathlib import Path

import imageio_ffmpeg
import mujoco
import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image
from scipy.ndimage import gaussian_filter1d

from envs.config.atomic_file import atomic_path, write_atomic
from envs.errors import InputError
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.renderer import renderer

Frame = UInt8[np.ndarray, "h w 3"]
README_BYTES = 2_000_000
QUALITIES = (80, 65, 50, 35, 20)
PALETTES = (256, 128, 64, 32, 16)


def follow(
    camera: Camera,
    positions_w: Float[np.ndarray, "frames 3"],
    fps: float,
    smooth_s: float = 0.5,
) -> list[Camera]:
    """Returns one camera per frame that keeps a body in view without shaking.

    lookat_t = lookat + Σ_s g(t − s) position_s on the floor, Gaussian g.

    The look-at point moves with the body's path over the floor after a Gaussian filter
    of width `smooth_s`, which looks both ways and so has no lag; its height stays
    where `camera` has it, so that bobbing of the body remains visible.

    Args:
        camera: view of the first frame; its look-at point is relative to the body's
            (smoothed) place on the floor.
        positions_w: the body in each frame [m].
        fps: frames per second.
        smooth_s: standard deviation of the filter [s].

    Source:
        Ours.
    """
    flat, width = positions_w[:, :2], smooth_s * fps
    path = np.asarray(gaussian_filter1d(flat, width, axis=0, mode="nearest"))
    x, y, z = camera.lookat_w
    return [replace(camera, lookat_w=(x + p[0], y + p[1], z)) for p in path]


def frames(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "frames nq"],
    cameras: Sequence[Camera],
    size: tuple[int, int] = (640, 480),
    drawn_by: str = "auto",
) -> Iterator[Frame]:
    """Draws one picture per recorded pose.

    Args:
        model: the scene.
        qpos: a recorded pose for each frame.
        cameras: a point of view for each frame.
        size: width and height in pixels.
        drawn_by: out of `renderer.RENDERERS`.

    Raises:
        InputError: such a renderer does not work here.
    """
    data = mujoco.MjData(model)
    with renderer(drawn_by, model, size) as draw:
        for pose, camera in zip(qpos, cameras, strict=True):
            data.qpos[:] = pose
            mujoco.mj_kinematics(model, data)
            yield draw(data, camera)


def write_mp4(path: Path, pictures: Iterable[Frame], fps: float, crf: int = 20) -> Path:
    """Writes an H.264 video that browsers play; complete or not at all.

    Args:
        path: file to write, replaced if it exists.
        pictures: frames of one size; odd edges lose their last row or column.
        fps: frames per second.
        crf: constant rate factor; lower is better and larger (18 to 28).

    Raises:
        InputError: there are no frames.
    """
    stream = iter(pictures)
    first = next(stream, None)
    if first is None:
        raise InputError(path, "frames", "no frames", "at least one")
    with (
        atomic_path(path) as partial,
        closing(_mp4_writer(partial, _even(first), fps, crf)) as writer,
    ):
        for picture in chain([first], stream):
            writer.send(_even(picture).tobytes())
    return path


def write_animation(
    path: Path,
    pictures: Iterable[Frame],
    fps: float,
    max_bytes: int = README_BYTES,
) -> Path:
    """Writes an endless `.webp` or `.gif`, as good as fits into `max_bytes`.

    WebP is about five times smaller than GIF at the same quality.

    Args:
        path: file to write; its suffix chooses the format.
        pictures: frames of one size.
        fps: frames per second; GIF rounds the interval to 10 ms.
        max_bytes: upper bound of the file's size.

    Raises:
        InputError: the suffix is unknown, there are no frames, or the coarsest quality
            does not fit.
    """
    images = [Image.fromarray(picture) for picture in pictures]
    if path.suffix not in (".webp", ".gif"):
        raise InputError(path, "suffix", path.suffix, "one of .webp, .gif")
    if not images:
        raise InputError(path, "frames", "no frames", "at least one")
    encode = _webp if path.suffix == ".webp" else _gif
    levels = QUALITIES if path.suffix == ".webp" else PALETTES
    size = 0
    for level in levels:
        content = encode(images, fps, level)
        size = len(content)
        if size <= max_bytes:
            return write_atomic(path, content)
    raise InputError(path, "size", f"{size} bytes", f"at most {max_bytes} bytes")


def _mp4_writer(path: Path, first: np.ndarray, fps: float, crf: int):
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (first.shape[1], first.shape[0]),
        fps=fps,  # pyright: ignore[reportArgumentType]  # any number works
        codec="libx264",
        quality=None,  # pyright: ignore[reportArgumentType]  # -crf rules
        macro_block_size=2,
        output_params=["-crf", str(crf), "-movflags", "+faststart"],
    )
    writer.send(None)
    return writer


def _even(picture: np.ndarray) -> np.ndarray:
    height, width = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
    return np.ascontiguousarray(picture[:height, :width])


def _webp(images: list[Image.Image], fps: float, quality: int) -> bytes:
    options = {"quality": quality, "method": 4, "minimize_size": False}
    return _animated(images, "WEBP", round(1000 / fps), options)


def _gif(images: list[Image.Image], fps: float, colours: int) -> bytes:
    """All frames share the palette of the middle one: no flicker, fewer bytes."""
    palette = images[len(images) // 2].quantize(colours, dither=Image.Dither.NONE)
    flat = [i.quantize(palette=palette, dither=Image.Dither.NONE) for i in images]
    return _animated(flat, "GIF", 10 * round(100 / fps), {"optimize": False})


def _animated(images: list[Image.Image], kind: str, pause_ms: int, options) -> bytes:
    memory = io.BytesIO()
    images[0].save(
        memory,
        kind,
        save_all=True,
        append_images=images[1:],
        duration=pause_ms,
        loop=0,
        **options,
    )
    return memory.getvalue()
