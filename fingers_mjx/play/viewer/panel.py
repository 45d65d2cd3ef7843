"""The knobs of the page, and its legend."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import viser

from fingers_mjx.play.viewer.colours import (
    AXES,
    FORCE,
    GHOST,
    PUSH,
    Rgb,
    hex_of,
)
from fingers_mjx.play.viewer.scene import FORCE_M_PER_N, LAYERS
from fingers_mjx.play.viewer.switches import Switch
from fingers_mjx.play.viewer.wishes import PUSHES, Wishes


@dataclass(frozen=True)
class Knobs:
    """What there is to turn.

    Attributes:
        ranges: of v_x, v_y [m/s] and yaw rate [rad/s] in training; None in tasks
            without commands.
        command: at the start.
        switches: effects of the drive.
        ghost: name of the measured log; None without.
    """

    ranges: tuple[tuple[float, float], ...] | None
    command: tuple[float, float, float]
    switches: tuple[Switch, ...]
    ghost: str | None = None


class Panel:
    """The knobs, and what they say now.

    Args:
        server: of the page; the knobs go where its context is.
        knobs: what there is to turn.
        colours: of the fingers.
    """

    def __init__(self, server: viser.ViserServer, knobs: Knobs, colours: Sequence[Rgb]):
        gui = server.gui
        self._status = gui.add_markdown("starting")
        self._paused = gui.add_checkbox("pause", False)
        self._pressed: deque[str] = deque()
        self._resets = 0
        gui.add_button("reset: a new episode").on_click(self._reset)
        self._sliders = _command_sliders(gui, knobs)
        with gui.add_folder("Push the palm"):
            self._push_n = gui.add_slider("force [N], 0.1 s", 0.5, 8.0, 0.5, 3.0)
            towards = gui.add_button_group("towards", tuple(PUSHES))
            towards.on_click(lambda event: self._pressed.append(event.target.value))
        with gui.add_folder("Effects of the drive", expand_by_default=False):
            gui.add_markdown("What the servos of a real hand do beside the model.")
            self._effects = [_EffectKnob(gui, switch) for switch in knobs.switches]
        with gui.add_folder("Show"):
            self._layers = {name: gui.add_checkbox(name, True) for name in LAYERS}
            self._follow = gui.add_checkbox("follow the hand", True)
            self._aside = None
            if knobs.ghost is not None:
                self._aside = gui.add_slider("log aside [m]", 0.0, 0.4, 0.01, 0.15)
            gui.add_html(legend(knobs.ghost, colours))

    def wishes(self) -> Wishes:
        """Returns the state of the knobs; a push is returned once."""
        command = None
        if self._sliders:
            x, y, turn = (float(slider.value) for slider in self._sliders)
            command = (x, y, turn)
        return Wishes(
            command=command,
            paused=self._paused.value,
            resets=self._resets,
            push=self._pressed.popleft() if self._pressed else None,
            push_n=float(self._push_n.value),
            effects=dict(knob.size for knob in self._effects if knob.on),
        )

    @property
    def layers(self) -> frozenset[str]:
        """What is to be drawn, out of `LAYERS`."""
        return frozenset(name for name, box in self._layers.items() if box.value)

    @property
    def follow(self) -> bool:
        """Whether the hand stays in the middle."""
        return self._follow.value

    @property
    def aside_m(self) -> float:
        """How far to its left the measured hand stands [m]."""
        return 0.0 if self._aside is None else float(self._aside.value)

    def say(self, text: str) -> None:
        """Shows a line about how it goes."""
        if self._status.content != text:
            self._status.content = text

    def _reset(self, _: object) -> None:
        self._resets += 1


class _EffectKnob:
    """A switch, and a slider for the size of what is on."""

    def __init__(self, gui: viser.GuiApi, switch: Switch):
        self._switch = switch
        label = switch.name.replace("_", " ")
        self._box = gui.add_checkbox(label, switch.own, hint=switch.equation)
        self._slider = None
        if not switch.own:
            step, label = switch.high / 50, f"size [{switch.unit}]"
            start = round(switch.size / step) * step
            self._slider = gui.add_slider(
                label, 0.0, switch.high, step, start, visible=False
            )
            self._box.on_update(self._show)

    @property
    def on(self) -> bool:
        return self._box.value

    @property
    def size(self) -> tuple[str, float]:
        slider = self._slider
        value = self._switch.size if slider is None else float(slider.value)
        return self._switch.name, value

    def _show(self, _: object) -> None:
        if self._slider is not None:
            self._slider.visible = self._box.value


def legend(ghost: str | None, colours: Sequence[Rgb]) -> str:
    """Returns what the colours mean, as HTML.

    Args:
        ghost: name of the measured log, if one is shown.
        colours: of the fingers.
    """
    cm = 100 * FORCE_M_PER_N
    rows = [
        _row([FORCE], f"forces on the hand, {cm:g} cm per newton"),
        _row([PUSH], "your push"),
        _row(colours, "springs from the fingertips to their footprint (balls)"),
        _row(AXES, "axes of V: x forward, y left, z up"),
    ]
    if ghost is not None:
        rows.append(_row([GHOST], f"measured: {ghost}"))
    return f'<div style="font-size:12px;padding:4px 12px">{"".join(rows)}</div>'


def _row(colours: Sequence[Rgb], text: str) -> str:
    dots = "".join(f'<span style="color:{hex_of(c)}">●</span>' for c in colours)
    return f"<div>{dots} {text}</div>"


def _command_knob(
    gui: viser.GuiApi, label: str, range_: tuple[float, float], start: float
) -> viser.GuiInputHandle[float]:
    """Returns a slider; a number that stays where training knew only one."""
    low, high = range_
    if low == high:
        return gui.add_number(label, start, disabled=True)
    return gui.add_slider(label, low, high, (high - low) / 64, start)


def _command_sliders(
    gui: viser.GuiApi, knobs: Knobs
) -> list[viser.GuiInputHandle[float]]:
    if knobs.ranges is None:
        return []
    labels = ("forward [m/s]", "left [m/s]", "turn [rad/s]")
    with gui.add_folder("Command"):
        return [
            _command_knob(gui, label, (low, high), start)
            for label, (low, high), start in zip(
                labels, knobs.ranges, knobs.command, strict=True
            )
        ]
