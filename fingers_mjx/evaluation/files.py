"""Files of an evaluation: per-episode Parquet table and JSON summary, each atomic."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from envs.config.atomic_file import write_atomic
from envs.config.settings.hand import UNIT
from envs.errors import InputError
from fingers_deploy.files import open_regular
from fingers_mjx.evaluation.stats import Summary, summarize

MAX_TABLE_BYTES = 1 << 28
SUMMARY_FILE, TABLE_FILE = "summary.json", "episodes.parquet"


def write_table(
    path: Path,
    columns: Mapping[str, np.ndarray],
    about: Mapping[str, str] | None = None,
) -> Path:
    """Writes one row per episode as Parquet.

    Args:
        path: file to write.
        columns: measure name to one value per episode; NaN means undefined.
        about: text stored beside the columns (task, policy, seed, ...).
    """
    rows = {"episode": np.arange(len(next(iter(columns.values())))), **columns}
    return write_columns(path, rows, about)


def write_columns(
    path: Path,
    columns: Mapping[str, np.ndarray | Sequence[Any]],
    about: Mapping[str, str] | None = None,
) -> Path:
    """Writes columns as Parquet.

    Args:
        path: file to write.
        columns: name to values, equally many; None is null.
        about: text stored beside the columns.
    """
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    table = table.replace_schema_metadata(dict(about or {}))
    memory = pa.BufferOutputStream()
    pq.write_table(table, memory, compression="zstd")
    return write_atomic(path, memory.getvalue().to_pybytes())


def read_table(path: Path) -> dict[str, np.ndarray]:
    """Returns the columns of a table that `write_table` wrote.

    Raises:
        InputError: the file is missing or is not a Parquet file.
    """
    try:
        with open_regular(path, MAX_TABLE_BYTES) as file:
            table = pq.ParquetFile(file).read()
    except (OSError, pa.ArrowException) as error:
        raise InputError(path, "", error, "a Parquet table of episodes") from error
    return {name: table[name].to_numpy() for name in table.column_names}


def summary_document(
    columns: Mapping[str, np.ndarray],
    task: str,
    policy: str,
    seed: int,
    steps_trained: int,
    commit: str | None = None,
) -> dict[str, object]:
    """Returns the summary of an evaluation as plain values for JSON.

    Keys: task, policy, episodes, seed, steps_trained, commit (if known) and measures,
    which maps each name to mean, std, n, low and high (95 % interval of the mean),
    median and p95 (95 % of the episodes are at most there). An undefined number, such
    as the mean of no episodes, is None. Where the task numbers independent units
    (`envs.task.UNIT`), these numbers are over means of each unit, and their number is
    in "units".

    Args:
        columns: measure name to one value per episode.
        task: name of the task.
        policy: name or path of the policy.
        seed: seed of the evaluation.
        steps_trained: environment steps behind the policy.
        commit: version of the code.
    """
    known: dict[str, object] = {} if commit is None else {"commit": commit}
    episodes = len(next(iter(columns.values())))
    if UNIT in columns:
        columns = over_units(columns)
        known["units"] = len(next(iter(columns.values())))
    measures = {name: _plain(summarize(v, seed=seed)) for name, v in columns.items()}
    return {
        "task": task,
        "policy": policy,
        "episodes": episodes,
        "seed": seed,
        "steps_trained": steps_trained,
        **known,
        "measures": measures,
    }


def over_units(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns one value per unit of each measure: the mean of its defined values.

    Args:
        columns: measure name to one value per episode, `UNIT` among them.
    """
    units = np.unique(columns[UNIT])
    own = [columns[UNIT] == unit for unit in units]
    return {
        name: np.array([_mean(values[which]) for which in own])
        for name, values in columns.items()
        if name != UNIT
    }


def _mean(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else math.nan


def by_kind(
    found: Sequence[Mapping[str, float]], episodes: int, seed: int
) -> list[dict[str, Any]]:
    """Returns summaries of measures, for each kind of episodes apart.

    Args:
        found: measures of every episode, `episodes` of each kind in turn.
        episodes: of each kind.
        seed: of the resampling.
    """
    kinds = [found[i : i + episodes] for i in range(0, len(found), episodes)]
    return [
        {
            name: _plain(summarize(np.array([one[name] for one in kind]), seed=seed))
            for name in kind[0]
        }
        for kind in kinds
    ]


def write_summary(path: Path, document: Mapping[str, object]) -> Path:
    """Writes the summary as JSON, without the non-standard NaN and Infinity."""
    text = json.dumps(document, indent=2, allow_nan=False) + "\n"
    return write_atomic(path, text)


def _plain(summary: Summary) -> dict[str, float | int | None]:
    values = asdict(summary)
    return {k: v if np.isfinite(v) else None for k, v in values.items()}
