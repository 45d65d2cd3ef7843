"""System identification: from measured logs of a hand to its hand model file."""

from importlib.util import find_spec
from pathlib import Path

_HERE = Path(__file__).resolve().parents[1]
for _name in ("rewards", "envs"):  # common names, of which there may be others
    _spec = find_spec(_name)
    _origin = _spec and _spec.origin
    if _origin and Path(_origin).resolve().parent != _HERE / _name:
        raise ImportError(
            f"package {_name}: found {_origin}; valid: {_HERE / _name}, so install "
            "fingers-mjx into an environment of its own and run it from a directory "
            f"without {_name}"
        )
