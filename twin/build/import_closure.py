"""Which code makes a cache entry: the modules of this package that its module imports, directly or through others.

Found in the source without running it, imports inside functions included. Left out are imports for type checkers
(`if TYPE_CHECKING:`), which never run, and the package's own `twin/__init__.py`, which offers every command of the
package to notebooks: a module that needs one of its parts names that part.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.metadata
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PACKAGE = "twin"
ROOT = Path(__file__).parents[2]  # the folder that holds the package
# What is installed under another name than its module has, or decides numbers together with another package:
DISTRIBUTIONS = {
    "jax": ("jax", "jaxlib"),
    "pypardiso": ("pypardiso", "mkl"),
    "skfem": ("scikit-fem",),
    "sksparse": ("scikit-sparse",),
}


@dataclass(frozen=True)
class Source:
    """A module's file."""

    digest: str  # sha256 of its bytes
    imports: frozenset[str]  # modules, and names that may be modules: "twin.rom.model", "twin.rom.model.AffineBody"


@dataclass(frozen=True)
class Closure:
    """All that a module runs."""

    modules: tuple[str, ...]  # of the package, sorted, the module itself included
    others: tuple[str, ...]  # top-level modules outside the package and the standard library, sorted


def import_closure(module: str, root: Path = ROOT) -> Closure:
    """The closure of a module of the package that lies in `root`. Raises ModuleNotFoundError where there is none."""
    if _file(module, root) is None:
        raise ModuleNotFoundError(f"no module {module} in {root}", name=module)
    found: set[str] = set()
    others: set[str] = set()
    ahead = [module]
    while ahead:
        name = ahead.pop()
        if name in found or name == PACKAGE:
            continue
        if name.partition(".")[0] != PACKAGE:
            others.add(name.partition(".")[0])
            continue
        path = _file(name, root)
        if path is not None:
            found.add(name)
            ahead += _source(path, name).imports
        ahead.append(name.rpartition(".")[0])  # a package runs before its modules; a class is in the module before it
    return Closure(tuple(sorted(found)), tuple(sorted(others - sys.stdlib_module_names)))


@cache
def closure_hash(module: str, root: Path = ROOT) -> str:
    """Hash of the text of a module's closure and of the versions of the libraries that it imports.

    Versions, because another numpy, scipy or scikit-fem may sum in another order or number a mesh otherwise.
    """
    closure = import_closure(module, root)
    digest = hashlib.sha256()
    for name in closure.modules:
        path = _file(name, root)
        assert path is not None
        digest.update(f"{name} {_source(path, name).digest}\n".encode())
    for name in closure.others:
        versions = (_version(package) for package in DISTRIBUTIONS.get(name, (name,)))
        digest.update(f"{name} {' '.join(versions)}\n".encode())
    return digest.hexdigest()


def _file(module: str, root: Path) -> Path | None:
    path = root.joinpath(*module.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


def _version(distribution: str) -> str:
    """Of an installed library; optional ones may be absent, and then another solver or reader takes their place."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "absent"


@cache  # the running code is what was read once
def _source(path: Path, module: str) -> Source:
    text = path.read_bytes()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    return Source(hashlib.sha256(text).hexdigest(), frozenset(_imports(ast.parse(text, str(path)).body, package)))


def _imports(statements: list[ast.stmt], package: str) -> Iterator[str]:
    """Names imported by statements and all statements inside them."""
    for statement in statements:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - statement.level] if statement.level else []
            base = ".".join([*above, *([statement.module] if statement.module else [])])
            yield from (base, *(f"{base}.{alias.name}" for alias in statement.names))
        else:
            for inside in _blocks(statement):
                yield from _imports(inside, package)


def _blocks(statement: ast.stmt) -> Iterator[list[ast.stmt]]:
    """The lists of statements inside one; expressions import nothing."""
    if not (isinstance(statement, ast.If) and _for_type_checkers(statement.test)):
        yield getattr(statement, "body", [])
    yield getattr(statement, "orelse", [])
    yield getattr(statement, "finalbody", [])
    for part in (*getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
        yield part.body


def _for_type_checkers(test: ast.expr) -> bool:
    return isinstance(test, ast.Name | ast.Attribute) and ast.unparse(test).endswith("TYPE_CHECKING")
