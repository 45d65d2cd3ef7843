"""From the file that a user writes to a sweep in which every default is resolved.

The resolved sweep stands in `spec.yaml` of its directory, with explicit configurations
in place of a search; beside it are its hands and the policy that it starts from. It
reads back to itself.
"""

import dataclasses
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from envs.config.atomic_file import PARTIAL, write_atomic
from envs.config.typed import dump_yaml, load_yaml, to_dict
from envs.errors import InputError
from envs.hand.hand_file import hand_yaml, load_hand_file
from fingers_deploy import load_bundle
from fingers_deploy.errors import shortened
from fingers_mjx.ppo.config import TrainConfig
from fingers_mjx.runs.directory import flat
from fingers_mjx.runs.settings import free_settings, new_settings
from fingers_mjx.studies.sweep.check import check_sweep, check_words
from fingers_mjx.studies.sweep.promote import check_promotion, measure
from fingers_mjx.studies.sweep.search import Overrides, gridded, sampled
from fingers_mjx.studies.sweep.spec import Sweep, free_names, seed_list

SPEC_FILE, HANDS, POLICIES = "spec.yaml", "hands", "policies"
LOCK_FILE = "sweep.lock"
BASE = "base"
"""Name of the configuration of a sweep that names none."""
ADDABLE = ("configurations", "seeds")
LENGTH = "iterations"
"""A resumed run may change it; in a sweep, members that are done have the old one."""
_ASK = """
import json
from envs.physics.backends import default_backend
said = []
backend = default_backend(said.append)
print("\\n" + json.dumps([backend, said]))
"""


def resolved(spec: Sweep, source: Path, backend: str) -> tuple[Sweep, dict[str, bytes]]:
    """Returns the sweep with its defaults, and the files that it names.

    Args:
        spec: as read from `source`.
        source: file of the specification; files are named relative to it.
        backend: physics backend of this machine.

    Returns:
        The sweep and the files to be kept, by their names in it.

    Raises:
        InputError: a hand file that cannot be read, configurations by two ways with the
            same name, or promotion by a measure that must be named.
        BundleError: a damaged bundle.
    """
    files: dict[str, bytes] = {}

    def kept(path: Any, field: str) -> str | None:
        if path is None:
            return None
        if not isinstance(path, str):
            valid = "text: the name of a hand file, or null"
            found = list(path) if isinstance(path, tuple) else path
            raise InputError(source, field, found, valid)
        hand = load_hand_file(source.parent / path)
        name = f"{HANDS}/{hand.sha256[:12]}.yaml"
        files[name] = hand_yaml(hand).encode()
        return name

    def kept_policy(path: str | None) -> str | None:
        if path is None:
            return None
        model = load_bundle(source.parent / path).model
        name = f"{POLICIES}/{hashlib.sha256(model).hexdigest()[:12]}.onnx"
        files[name] = model
        return name

    def with_hand(name: str, settings: Overrides) -> Overrides:
        if "hand" not in settings:
            return settings
        field = f"configurations.{name}.hand"
        return {**settings, "hand": kept(settings["hand"], field)}

    backend, promote = spec.backend or backend, spec.promote
    if promote is not None:
        promote = dataclasses.replace(promote, by=measure(spec, source))
    engine = spec.engine or ("population" if backend == "warp" else "local")
    all_cores = engine == "population" or backend == "warp"
    evaluate = spec.evaluate
    made = dataclasses.replace(
        spec,
        preset=spec.preset or ("fast" if backend == "warp" else "cpu"),
        hand=kept(spec.hand, "hand"),
        backend=backend,
        warm_start=kept_policy(spec.warm_start),
        configurations={
            name: with_hand(name, settings)
            for name, settings in _configurations(spec, source).items()
        },
        search=None,
        grid=None,
        seeds=seed_list(spec.seeds),
        evaluate=dataclasses.replace(evaluate, backend=evaluate.backend or backend),
        promote=promote,
        engine=engine,
        threads=spec.threads or (None if all_cores else 1),
    )
    return made, files


def machine_backend(on_fault: Callable[[str], None] = lambda said: None) -> str:
    """Returns the backend that `fingers train` takes by itself on this machine.

    Asked of a process of its own: one that has looked for a GPU keeps part of it.

    Args:
        on_fault: called with what JAX says where Warp is there and no CUDA device.
    """
    command = [sys.executable, "-c", _ASK]
    environment = {**os.environ, "TF_CPP_MIN_LOG_LEVEL": "3"}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    )
    backend, faults = json.loads(done.stdout.splitlines()[-1])
    for said in faults:
        on_fault(said)
    return backend


def saved_sweep(directory: Path) -> Sweep | None:
    """Returns the sweep of a directory, None if there is none."""
    path = directory / SPEC_FILE
    return load_yaml(Sweep, path) if path.exists() else None


def keep_sweep(
    written: Sweep,
    source: Path,
    root: Path,
    default_backend: Callable[[], str] = machine_backend,
) -> Sweep:
    """Resolves a sweep, checks it, and writes it and its files to its directory.

    Args:
        written: as read from `source`.
        source: file of the specification.
        root: directory of the sweep.
        default_backend: returns the backend of a sweep that names none.

    Raises:
        InputError: a setting that cannot work, or that is not that of the sweep in the
            directory; a directory with something else in it.
    """
    saved = saved_sweep(root)
    backend = written.backend or (saved.backend if saved else None)
    backend = backend or default_backend()
    check_words(written, source, backend)
    spec, files = resolved(written, source, backend)
    if saved is None:
        _check_empty(root)
    else:
        check_only_added(saved, spec, source)
    for name, data in files.items():
        (root / name).parent.mkdir(exist_ok=True)
        write_atomic(root / name, data)
    check_sweep(spec, root, source)
    check_promotion(spec, source)
    write_atomic(root / SPEC_FILE, dump_yaml(spec))
    return spec


def _check_empty(root: Path) -> None:
    """Refuses to begin a sweep among other files."""
    ours = (LOCK_FILE, HANDS, POLICIES)
    names = [p.name for p in root.iterdir() if not p.name.startswith(PARTIAL)]
    if others := sorted(set(names) - set(ours)):
        raise InputError(root, "", others[0], "a new or empty directory")


def check_only_added(saved: Sweep, spec: Sweep, source: Path) -> None:
    """Refuses a sweep that is not the saved one with more seeds or configurations.

    How members are trained (engine, processes) may change too, as does not change them;
    so may the settings that a resumed run may change, but for `LENGTH`.

    Raises:
        InputError: naming the first field that differs.
    """
    free = free_settings(new_settings(TrainConfig(task=spec.task))) - {LENGTH}
    saved, spec = _without(saved, free), _without(spec, free)
    for name in ADDABLE:
        was, found = _addable(saved, name), _addable(spec, name)
        for key, value in was.items():
            if key not in found or found[key] != value:
                now = found.get(key, "nothing")
                raise _changed(source, f"{name}.{key}", now, value)
    others = {f.name for f in dataclasses.fields(Sweep)} - {*ADDABLE, *free_names()}
    was, found = (
        flat({k: v for k, v in to_dict(s).items() if k in others})
        for s in (saved, spec)
    )
    for key in sorted(was.keys() | found.keys()):
        if was.get(key) != found.get(key):
            now, before = found.get(key, "nothing"), was.get(key, "nothing")
            raise _changed(source, key, now, before)


def _without(spec: Sweep, names: set[str]) -> Sweep:
    """Returns a sweep that leaves some settings to their defaults."""

    def rest(settings: Overrides) -> Overrides:
        return {name: value for name, value in settings.items() if name not in names}

    stages = [dataclasses.replace(stage, set=rest(stage.set)) for stage in spec.stages]
    return dataclasses.replace(
        spec,
        set=rest(spec.set),
        stages=tuple(stages),
        configurations={name: rest(own) for name, own in spec.configurations.items()},
    )


def _configurations(spec: Sweep, source: Path) -> dict[str, Overrides]:
    """Returns all configurations, those of search and grid after those with names."""
    found = dict(spec.configurations)
    for more in (
        sampled(spec.search) if spec.search else {},
        gridded(spec.grid) if spec.grid else {},
    ):
        if twice := sorted(found.keys() & more.keys()):
            valid = "a name that search and grid do not give"
            raise InputError(source, f"configurations.{twice[0]}", twice[0], valid)
        found |= more
    return found or {BASE: {}}


def _addable(spec: Sweep, name: str) -> dict[Any, Any]:
    value = getattr(spec, name)
    return value if isinstance(value, dict) else {seed: seed for seed in value}


def _changed(source: Path, field: str, found: Any, was: Any) -> InputError:
    shown = [shortened(json.dumps(x, default=list), 50) for x in (found, was)]
    valid = f"{shown[1]}, as the sweep was begun; seeds and configurations can be added"
    return InputError(source, field, shown[0], valid)
