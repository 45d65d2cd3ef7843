"""Everything once: evaluate and play a policy, learn one, export it, one report."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fingers_mjx.demo.learn import LearnSize, learn
from fingers_mjx.demo.report import write_demo_report
from fingers_mjx.demo.show import ShowSize, show
from fingers_mjx.policy.source import PolicySource, load_bundle_setup

POLICY_DIR = Path(__file__).parents[1] / "policies" / "crawl"
"""The committed crawl policy."""


@dataclass(frozen=True)
class DemoSize:
    """How much of everything."""

    show: ShowSize = field(default_factory=ShowSize)
    learn: LearnSize = field(default_factory=LearnSize)


def demo(
    out: Path,
    bundle_dir: Path,
    commands: Sequence[str] = (),
    size: DemoSize | None = None,
) -> Path:
    """Runs the demonstration and returns its report; progress goes to stdout.

    Args:
        out: directory for everything; made if missing.
        bundle_dir: policy to evaluate and play.
        commands: that made it, for the report.
        size: how much of everything; minutes on two cores if not given.

    Raises:
        InputError, BundleError: no policy there, or one of another version.
    """
    size = size or DemoSize()
    bundle, setup = load_bundle_setup(bundle_dir)
    trained_steps = bundle.manifest.provenance.normalizer.steps
    source = PolicySource(bundle_dir, setup, bundle.network, trained_steps)
    out.mkdir(parents=True, exist_ok=True)
    shown = show(out, bundle, source, size.show)
    learned = learn(out, size.learn)
    return write_demo_report(out / "report.html", shown, learned, commands)
