"""`fingers export`: the policy of a run as a bundle."""

import argparse

from envs.errors import InputError
from fingers_mjx.cli.arguments import options


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "export",
        run,
        "write the policy of a run as a bundle",
        "Write the policy of a run as a bundle. policy.onnx, manifest.json, "
        "config.yaml and hand.yaml; fails if ONNX Runtime and JAX differ by more than "
        "1e-5.",
        computes=False,
    )
    parser.set_defaults(check=_check)
    what = "run directory; with --command-gain also a bundle"
    options.path(parser, "run_dir", metavar="RUN", help=what)
    what = "directory of the bundle; default RUN"
    options.path(parser, "--out", metavar="DIR", help=what)
    parser.add_argument(
        "--command-gain",
        type=options.number(0.1, 10.0),
        nargs=3,
        metavar=("VX", "VY", "WZ"),
        help="show the policy its command times these factors, where it falls short of "
        "commands; into another directory, --out",
    )


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be exported, before JAX loads."""
    from fingers_mjx.policy.place import check_kind, check_run

    (check_kind if args.command_gain else check_run)(args.run_dir)
    args.out = args.out or args.run_dir
    source = args.run_dir if args.run_dir.is_dir() else args.run_dir.parent
    if args.command_gain and args.out.resolve() == source.resolve():
        valid = "another directory: the policy would be lost"
        raise InputError("--out", "", args.out, valid)
    options.check_directory("--out", args.out)


def run(args: argparse.Namespace) -> int:
    """Exports and prints how far the runtimes are from JAX."""
    from fingers_mjx.export.command_gain import export_with_gain
    from fingers_mjx.export.run import export_run

    if args.command_gain:
        report = export_with_gain(args.run_dir, args.out, args.command_gain)
    else:
        report = export_run(args.run_dir, args.out)
    print(
        f"wrote {args.out}: policy.onnx, manifest.json, config.yaml, hand.yaml\n"
        f"largest difference from JAX over {report.observations:,} observations: "
        f"ONNX Runtime {report.onnxruntime:.2g}, NumPy {report.numpy:.2g} "
        "(valid: to 1e-5 times the larger of 1 and the output before the clip)"
    )
    return 0
