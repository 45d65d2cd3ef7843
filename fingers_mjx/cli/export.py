"""`fingers export`: the policy of a run as a bundle."""

import argparse

from fingers_mjx.cli.paths import check_directory
from fingers_mjx.export.run import export_run
from fingers_mjx.policy.source import check_run


def run(args: argparse.Namespace) -> int:
    """Exports and says how far the runtimes are from JAX."""
    check_run(args.run_dir)
    out = args.out or args.run_dir
    check_directory("--out", out)
    report = export_run(args.run_dir, out)
    print(
        f"wrote {out}: policy.onnx, manifest.json, config.yaml, hand.yaml\n"
        f"largest difference from JAX over {report.observations:,} observations: "
        f"ONNX Runtime {report.onnxruntime:.2g}, NumPy {report.numpy:.2g} "
        "(1e-5 is the limit)"
    )
    return 0
