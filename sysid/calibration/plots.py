"""Pictures of a calibration: trajectories of joints, pulls, and Table I."""

from pathlib import Path

import numpy as np

from sysid.calibration.calibrate import Calibration
from sysid.calibration.joint import JointFit

_MEASURED, _SIMULATED = "#0072B2", "#D55E00"
_PANELS = ("angle [rad]", "effort [N·m]")


def write_plots(found: Calibration, folder: Path) -> list[Path]:
    """Draws one picture per joint, one of all pulls and one of all parameters.

    Raises:
        ModuleNotFoundError: matplotlib, of the optional dependencies `viz`, is missing.
    """
    import matplotlib

    matplotlib.use("Agg", force=False)
    paths = [
        _joint(fit, folder / f"{joint}.png") for joint, fit in found.joints.items()
    ]
    if found.pulls:
        paths.append(_pulls(found, folder / "pulls.png"))
    return [*paths, _table(found, folder / "table1.png")]


def _joint(fit: JointFit, path: Path) -> Path:
    """Measured against simulated, with the residual below."""
    from matplotlib.figure import Figure

    record, simulated = fit.records[0], fit.simulated[0]
    logged = [i for i in range(2) if np.any(record.valid[:, i])]
    figure = Figure((9.0, 2.6 * len(logged) + 1.0), layout="constrained")
    axes = figure.subplots(2 * len(logged), 1, sharex=True, squeeze=False)[:, 0]
    for row, i in enumerate(logged):
        measured = np.where(record.valid[:, i], record.measured[:, i], np.nan)
        top, rest = axes[2 * row], axes[2 * row + 1]
        top.plot(record.t_s, measured, color=_MEASURED, lw=2.2, label="measured")
        top.plot(
            record.t_s, simulated[:, i], color=_SIMULATED, lw=0.8, label="simulated"
        )
        top.set_ylabel(_PANELS[i])
        rest.plot(record.t_s, measured - simulated[:, i], color="0.3", lw=0.5)
        rest.set_ylabel("difference")
    axes[0].legend(loc="upper right", frameon=False, ncols=2)
    kp = f"{fit.values['stiffness']:.3f} ({fit.low['stiffness']:.3f}"
    axes[0].set_title(
        f"{fit.joint}: stiffness × {kp} to {fit.high['stiffness']:.3f}), delay "
        f"{1e3 * fit.values['delay_s']:.1f} ms",
        loc="left",
        fontsize=9,
    )
    axes[-1].set_xlabel("time [s]")
    figure.savefig(path, dpi=110)
    return path


def _pulls(found: Calibration, path: Path) -> Path:
    """Pull over normal force, with the time in which the tip slid."""
    from matplotlib.figure import Figure

    figure = Figure((8.0, 3.5), layout="constrained")
    axes = figure.subplots()
    for pull in found.pulls:
        name = f"{pull.finger}, {pull.normal_n:g} N: {pull.friction:.3f}"
        (line,) = axes.plot(pull.t_s, pull.ratio, lw=0.8, label=name)
        span = (pull.start_s, pull.stop_s)
        axes.plot(span, [pull.friction] * 2, color=line.get_color(), lw=3)
    mean = found.shared["tip_friction"]
    axes.axhspan(mean.low, mean.high, color="0.85", zorder=0)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("pull / normal force")
    axes.legend(frameon=False, loc="lower center")
    figure.savefig(path, dpi=110)
    return path


def _table(found: Calibration, path: Path) -> Path:
    """All parameters as points with their intervals."""
    from matplotlib.figure import Figure

    rows = [(name, e.value, e.low, e.high, e.unit) for name, e in found.shared.items()]
    rows += [
        (f"stiffness {j}", f.values["stiffness"], f.low["stiffness"],
         f.high["stiffness"], "×")
        for j, f in found.joints.items()
    ]  # fmt: skip
    figure = Figure((8.0, 0.32 * len(rows) + 1.0), layout="constrained")
    axes = figure.subplots()
    for y, (_, value, low, high, _) in enumerate(rows):
        # Relative, for the parameters have different units.
        bounds = (low / value - 1.0, high / value - 1.0)
        if np.all(np.isfinite(bounds)):
            axes.plot(np.multiply(100.0, bounds), [y, y], color=_MEASURED, lw=2)
        axes.plot(0.0, y, "o", color=_MEASURED, ms=4)
    labels = [f"{name}  {value:.4g} {unit}" for name, value, _, _, unit in rows]
    axes.set_yticks(range(len(rows)), labels, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("95 % interval around the value [%]")
    figure.savefig(path, dpi=110)
    return path
