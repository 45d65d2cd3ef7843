"""Environments of the hand: model and drive, physics, signals, tasks and registry."""

import warnings
from importlib.util import find_spec
from pathlib import Path

_HERE = Path(__file__).resolve().parents[1]
for _name in ("rewards", "sysid"):  # common names, of which there may be others
    _spec = find_spec(_name)
    _origin = _spec and _spec.origin
    if _origin and Path(_origin).resolve().parent != _HERE / _name:
        _said = (
            f"package {_name}: found {_origin}; valid: {_HERE / _name}, so install "
            "fingers-mjx into an environment of its own and run it from a directory "
            f"without {_name}"
        )
        if _name == "rewards":
            raise ImportError(_said)
        warnings.warn(_said, stacklevel=2)  # nothing here needs it
