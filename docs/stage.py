"""Gathers the pages of the documentation's site where they stand in the repository.

    python -m docs.stage     # part of `make docs`

The site is built from copies under build/site-pages, in the folders of the repository,
so that one relative link is right in a checkout, on a code host and on the site.
"""

import shutil
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "build" / "site-pages"
WANTED = (
    "*.md",
    "LICENSE",
    "docs/*/*.md",
    "docs/results/gallery/*.md",
    "docs/images/*",
    "notebooks/*.ipynb",
    "notebooks/policies/README.md",
    "deploy/README.md",
    "examples/*/README.md",
    "examples/*/pyproject.toml",
    "fingers_mjx/policies/*/README.md",
)


def sources() -> list[Path]:
    """The files of the site, relative to the repository."""
    found = {path.relative_to(ROOT) for glob in WANTED for path in ROOT.glob(glob)}
    return sorted(found)


def main() -> None:
    """Copies the files, into an emptied folder."""
    shutil.rmtree(PAGES, ignore_errors=True)
    for path in sources():
        (PAGES / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / path, PAGES / path)


if __name__ == "__main__":
    main()
