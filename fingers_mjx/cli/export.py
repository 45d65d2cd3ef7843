"""`fingers export`: the policy of a run as a bundle."""

import argparse

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
    options.path(parser, "run_dir", metavar="RUN", help="run directory")
    what = "directory of the bundle; default RUN"
    options.path(parser, "--out", metavar="DIR", help=what)


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be exported, before JAX loads."""
    from fingers_mjx.policy.place import check_run

    check_run(args.run_dir)
    args.out = args.out or args.run_dir
    options.check_directory("--out", args.out)


def run(args: argparse.Namespace) -> int:
    """Exports and prints how far the runtimes are from JAX."""
    from fingers_mjx.export.run import export_run

    report = export_run(args.run_dir, args.out)
    print(
        f"wrote {args.out}: policy.onnx, manifest.json, config.yaml, hand.yaml\n"
        f"largest difference from JAX over {report.observations:,} observations: "
        f"ONNX Runtime {report.onnxruntime:.2g}, NumPy {report.numpy:.2g} "
        "(valid: to 1e-5 times the larger of 1 and the output before the clip)"
    )
    return 0
