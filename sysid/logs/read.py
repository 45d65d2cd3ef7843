"""Reads and writes measured logs in the format that the name of the file says."""

from pathlib import Path

from envs.errors import InputError
from fingers_deploy.files import is_folder
from sysid.logs.bag import BagMap, read_bag
from sysid.logs.csv_file import read_csv, write_csv
from sysid.logs.log import MeasuredLog
from sysid.logs.outside import outside_suffixes, read_outside
from sysid.logs.parquet import read_parquet, write_parquet

_READ = {".csv": read_csv, ".parquet": read_parquet}
_WRITE = {".csv": write_csv, ".parquet": write_parquet}
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
    """
    file = Path(path)
    folder = is_folder(file)
    if not file.exists():
        raise InputError(file, "", "no such file", _VALID)
    if folder or file.suffix == ".mcap":
        return read_bag(file, bag_map)
    if bag_map is not None:
        raise InputError(
            file, "", "a map of topics", "one with a bag or MCAP file only"
        )
    if file.suffix not in _READ and file.suffix in outside_suffixes():
        return read_outside(file)
    return _chosen(_READ, file)(file)


def write_log(log: MeasuredLog, path: str | Path) -> None:
    """Writes a log as `.csv` or `.parquet`.

    Raises:
        InputError: another suffix.
        ModuleNotFoundError: the optional dependencies `data` are missing.
    """
    file = Path(path)
    _chosen(_WRITE, file)(log, file)


def _chosen(table: dict, file: Path):
    """Returns the function for the suffix of a file."""
    if file.suffix not in table:
        raise InputError(file, "", file.suffix or "no suffix", _VALID)
    return table[file.suffix]
