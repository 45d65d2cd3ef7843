"""What a measured log holds, in lines of text."""

import numpy as np

from sysid.logs.columns import quantity_of
from sysid.logs.log import MeasuredLog


def info_lines(log: MeasuredLog) -> list[str]:
    """Returns the digest, the header, and for every column its range and timing.

    Raises:
        InputError: a column with fewer than two readings or a clock that stands.
    """
    header = log.header
    load = f"{header.load.mass_kg:g} kg at {header.load.lever_m:g} m"
    settings = ", ".join(f"{k} {v:g}" for k, v in header.settings.items())
    lines = [
        f"sha256    {log.sha256}",
        f"joints    {', '.join(header.joints)}",
        f"mounting  {header.mounting}; load {load}",
        f"rows      {len(log)} in {np.ptp(log.t_s):.3f} s",
    ]
    lines += [f"settings  {settings}"] * bool(settings)
    lines += [f"note      {header.note}"] * bool(header.note)
    return lines + [_column_line(log, name) for name in log.columns]


def _column_line(log: MeasuredLog, name: str) -> str:
    """Describes one column: range, unit, rate, and all that is irregular."""
    _, values = log.samples(name)
    found = log.timing(name)
    unit = log.header.units[quantity_of(name)]
    counts = {
        "missing": int(log.missing(name).sum()),
        "gaps": found.gaps.size,
        "repeated times": found.repeated.size,
        "steps back": found.backward.size,
    }
    irregular = [f"{count} {what}" for what, count in counts.items() if count]
    span = f"{values.min():.6g} to {values.max():.6g} {unit}"
    rate = f"{1.0 / found.period_s:.1f} Hz, jitter {1e3 * found.jitter_s:.3f} ms"
    return "; ".join([f"{name}: {span}", rate, *irregular])
