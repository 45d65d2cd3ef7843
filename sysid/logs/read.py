"""Reads and writes measured logs in the format that the name of the file says."""

from pathlib import Path

from envs.errors import InputError
from fingers_deploy.files import is_folder
from sysid.logs.bag import BagMap, read_bag
from sysid.logs.bag_write import write_bag, write_mcap
from sysid.logs.csv_file import read_csv, write_csv
from sysid.logs.lerobot import is_lerobot, read_lerobot, write_lerobot
from sysid.logs.log import MeasuredLog
from sysid.logs.outside import outside_suffixes, read_outside
from sysid.logs.parquet import read_parquet, write_parquet

_READ = {".csv": read_csv, ".parquet": read_parquet}
_WRITE = {".csv": write_csv, ".parquet": write_parquet, ".mcap": write_mcap}
FOLDERS = {"bag": write_bag, "lerobot": write_lerobot}
"""Formats that are folders, which no suffix distinguishes."""
_VALID = "a .csv, .parquet or .mcap file, or the folder of a ROS 2 bag"


def read_log(path: str | Path, bag_map: BagMap | None = None) -> MeasuredLog:
    """Reads a measured log.

    Args:
        path: `.csv`, `.parquet`, `.mcap`, or the folder of a ROS 2 bag; or a file of
            a suffix that another installed package reads.
        bag_map: topics, names and header of a bag or MCAP file, which says less than a
            log needs; the recordings of `fingers-deploy` need none.

    Raises:
        InputError: not such a file, or its contents are no log.
        ModuleNotFoundError: the optional dependencies `data` are missing.

    Examples:
        >>> import tempfile
        >>> import numpy as np
        >>> from sysid.logs.log import make_log
        >>> t_s = np.arange(5) / 100
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder) / "knuckle.csv"
        ...     columns = {"cmd.knuckle": 2 * t_s, "pos.knuckle": t_s}
        ...     write_log(make_log(("knuckle",), t_s, columns), file)
        ...     log = read_log(file)
        >>> print(len(log), log.header.joints, log.column("pos.knuckle")[-1])
        5 ('knuckle',) 0.04
    """
    file = Path(path)
    folder = is_folder(file)
    if not file.exists():
        raise InputError(file, "", "no such file", _VALID)
    if folder and is_lerobot(file):
        return read_lerobot(file)
    if folder or file.suffix == ".mcap":
        return read_bag(file, bag_map)
    if bag_map is not None:
        raise InputError(
            file, "", "a map of topics", "one with a bag or MCAP file only"
        )
    if file.suffix not in _READ and file.suffix in outside_suffixes():
        return read_outside(file)
    return _chosen(_READ, file)(file)


def write_log(log: MeasuredLog, path: str | Path, folder: str | None = None) -> None:
    """Writes a log as `.csv`, `.parquet` or `.mcap`, or as a folder.

    Args:
        log: it is read back as it is, to the bit.
        path: of the file or folder.
        folder: one of `FOLDERS`.

    Raises:
        InputError: another suffix, or a log that the format cannot hold.
        ModuleNotFoundError: the optional dependencies `data` are missing.
    """
    file = Path(path)
    if folder is not None:
        FOLDERS[folder](log, file)
        return
    _chosen(_WRITE, file)(log, file)


def _chosen(table: dict, file: Path):
    """Returns the function for the suffix of a file."""
    if file.suffix not in table:
        raise InputError(file, "", file.suffix or "no suffix", _VALID)
    return table[file.suffix]
