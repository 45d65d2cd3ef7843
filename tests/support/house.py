"""How the source is built: sizes, entries of folders, and what docstrings state."""

import ast
import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "rewards": ROOT / "rewards",
    "envs": ROOT / "envs",
    "sysid": ROOT / "sysid",
    "fingers_mjx": ROOT / "fingers_mjx",
    "fingers_deploy": ROOT / "deploy" / "fingers_deploy",
    "fingers_robot": ROOT / "deploy" / "fingers_robot",
    "benchmarks": ROOT / "benchmarks",
    "deploy/benchmarks": ROOT / "deploy" / "benchmarks",
}
SHAPED = re.compile(r"\b(Float|Int|Bool|Num|Real|Shaped|Integer|UInt8|Complex)\[")
BARE = re.compile(r"(?<!\[)\b(np\.ndarray|jax\.Array|NDArray|ArrayLike|Array)\b(?!,)")
KINDS = {
    "equation": re.compile(r"[=←∈Σ∫√‖∧≈→↦ᵀ]|\bexp\(|\barg ?min|²"),
    "units": re.compile(
        r"\[[^\]]*\b(m|rad|N|s|Hz|kg|V|A|K|°|nat|steps?|counts?|1)\b[^\]]*\]"
        r"|\[(–|%|°)\]|\b(no|without) unit|dimensionless"
    ),
    "source": re.compile(r"^\s*Source:\s*$", re.MULTILINE),
}
"""What a docstring states; shapes are read off the annotations, which tests execute."""


@dataclass(frozen=True)
class Function:
    """One function of the source.

    Attributes:
        where: file and name.
        node: its definition.
        public: neither it, nor its class, nor what it is inside is private.
        constructor: of a dataclass or another class.
    """

    where: str
    node: ast.FunctionDef | ast.AsyncFunctionDef
    public: bool


def files(package):
    """The Python files of a package, sorted."""
    return sorted(PACKAGES[package].rglob("*.py"))


def lines(package):
    """Lines of all files of a package together."""
    return sum(len(f.read_text("utf-8").splitlines()) for f in files(package))


def functions(package):
    """All functions and methods of a package; inner ones count as private."""
    return [f for file in files(package) for f in functions_of(file)]


def functions_of(file, text=None):
    """All functions and methods of one file."""
    tree = ast.parse(text or file.read_text("utf-8"))
    return list(_walk(tree, _name(file), True))


def _name(file):
    return str(file.relative_to(ROOT)) if file.is_absolute() else str(file)


def _walk(node, where, public):
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            shown = public and not child.name.startswith("_")
            yield Function(f"{where}:{child.name}", child, shown)
            yield from _walk(child, f"{where}:{child.name}", False)
        elif isinstance(child, ast.ClassDef):
            shown = public and not child.name.startswith("_")
            yield from _walk(child, f"{where}:{child.name}", shown)
        else:
            yield from _walk(child, where, public)


def body_lines(node):
    """Lines of a function's body without its docstring."""
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def parameters(node):
    """How many parameters a caller may give."""
    a = node.args
    named = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    return len([n for n in named if n not in ("self", "cls")])


def annotations(node):
    """The annotations of a signature, as text."""
    a = node.args
    every = [*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg]
    given = [x.annotation for x in every if x is not None]
    return [ast.unparse(x) for x in (*given, node.returns) if x is not None]


def is_numeric(function):
    """Whether a public function takes or returns arrays."""
    decorators = [ast.unparse(d) for d in function.node.decorator_list]
    hidden = any(d.endswith(("property", "overload", ".setter")) for d in decorators)
    signature = annotations(function.node)
    arrays = any(SHAPED.search(x) or BARE.search(x) for x in signature)
    return function.public and arrays and not hidden


def states(node):
    """Which of equation, shapes, units and source a function states."""
    text = ast.get_docstring(node) or ""
    found = {kind for kind, pattern in KINDS.items() if pattern.search(text)}
    bare = [x for x in annotations(node) if BARE.search(SHAPED.sub("[", x))]
    return found if bare else found | {"shapes"}


def undocumented(package):
    """Public numeric functions of a package that lack one of the four, and of how many.

    Returns:
        Names with what they lack, and the number of all public numeric functions.
    """
    every = [f for f in functions(package) if is_numeric(f)]
    wanted = {"shapes", *KINDS}
    lacking = {f.where: sorted(wanted - states(f.node)) for f in every}
    return {where: lack for where, lack in lacking.items() if lack}, len(every)


def entries(folder):
    """Entries of a folder that a newcomer sees."""
    seen = (path.name for path in folder.iterdir())
    return sorted(n for n in seen if n not in ("__pycache__", "py.typed"))
