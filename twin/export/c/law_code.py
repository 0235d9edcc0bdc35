"""Laws in C and in Octave, translated from what JAX traces of them: a new law needs no code of its own there.

A use of a law with its parameters is traced on scalar signals and states; what depends on parameters alone is a number
by then. The rest is a list of operations on scalars, each of which is one line. In Octave the same line serves arrays.
"""

from __future__ import annotations

import twin.float64  # noqa: F401  isort: skip  laws are traced in double precision

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import jax
import numpy as np

from twin.errors import TwinError
from twin.physics.laws import LAWS
from twin.rom.law_values import parameters_of, states_of
from twin.rom.load_model import LawUse


@dataclass(frozen=True)
class Language:
    """How a language writes what laws are made of; {0}, {1}, ... are operands."""

    number: Callable[[float], str]
    infix: Mapping[str, str]
    calls: Mapping[str, str]
    forms: Mapping[str, str]  # of select_n (condition, where false, where true), clamp, square, sign
    line: str  # a name and its value
    table: str  # two lines of numbers, their count, the place to read them at, and a number for names


def number(value: float) -> str:
    """A number in C, exact in double precision."""
    if math.isnan(value) or math.isinf(value):
        return "NAN" if math.isnan(value) else ("INFINITY" if value > 0 else "(-INFINITY)")
    text = repr(float(value))
    return f"R({text})" if value >= 0 else f"(R({text}))"


_COMPARE = {"gt": ">", "lt": "<", "ge": ">=", "le": "<=", "eq": "==", "ne": "!="}
_SCALAR = {"add": "+", "sub": "-", "mul": "*", "div": "/", "and": "&&", "or": "||"} | _COMPARE
_ARRAY = {"add": "+", "sub": "-", "mul": ".*", "div": "./", "and": "&", "or": "|"} | _COMPARE
_SHARED = ("exp", "log", "sqrt", "tan", "atan", "cos", "sin", "expm1", "log1p")  # functions of one name everywhere

C = Language(
    number=number,
    infix=_SCALAR,
    calls={name: name.upper() for name in _SHARED} | {"abs": "FABS", "pow": "POW", "max": "FMAX", "min": "FMIN"},
    forms={"select_n": "{0} ? {2} : {1}", "clamp": "FMIN(FMAX({1}, {0}), {2})", "square": "{0} * {0}",
           "sign": "(real)(({0} > 0) - ({0} < 0))"},
    line="    const {kind} {name} = {value};\n",
    table="    static const real x{k}[] = {{{at}}};\n    static const real y{k}[] = {{{values}}};\n"
          "    const real v{k} = interpolated(x{k}, y{k}, {count}, {x});\n",
)  # fmt: skip
# `where` is a function of three arrays that the script has (tests/reference/exports/step_log.m).
OCTAVE = Language(
    number=lambda value: repr(float(value)),
    infix=_ARRAY,
    calls={name: name for name in (*_SHARED, "abs", "max", "min")} | {"pow": "power"},
    forms={"select_n": "where({0}, {2}, {1})", "clamp": "min(max({1}, {0}), {2})", "square": "{0} .* {0}",
           "sign": "sign({0})"},
    line="{name} = {value};\n",
    table="v{k} = interp1([{at}], [{values}], min(max({x}, {low}), {high}));\n",
)  # fmt: skip
_SAME = ("convert_element_type", "copy", "stop_gradient", "broadcast_in_dim", "squeeze", "reshape")
_INTERPOLATION = "_interp"  # jax.numpy.interp, whose search is a loop: the C code has its own


def arguments_of(use: LawUse) -> tuple[str, ...]:
    """The arguments of the C function of a use: signals by name of the argument, then states."""
    return (*sorted(use.signals), *states_of(use))


def law_code(name: str, use: LawUse, holds: bool = False) -> str:
    """A C function `name` of one law, or of whether it is inside its validity, at values of `arguments_of(use)`.

    Raises TwinError for a law that uses an operation without a line of C.
    """
    own = [f"{a}_in" for a in arguments_of(use)]  # some arguments are words of C, such as switch
    lines, result = _translated(use, own, C, holds)
    given = ", ".join(f"real {a}" for a in own) or "void"
    unused = "".join(f"    (void){a};\n" for a in own)
    kind = "int" if holds else "real"
    return f"static {kind} {name}({given})\n{{\n{unused}{''.join(lines)}    return {result};\n}}\n"


def law_lines(use: LawUse) -> str:
    """Assignments in Octave that make `result` of one law from arrays ARGUMENT_in, for `arguments_of(use)`.

    Raises TwinError as `law_code`.
    """
    lines, result = _translated(use, [f"{a}_in" for a in arguments_of(use)], OCTAVE)
    return "".join(lines) + f"result = {result};\n"


def _translated(use: LawUse, own: list[str], language: Language, holds: bool = False) -> tuple[list[str], str]:
    """The lines that the result depends on (compilers warn of others), and the result."""
    law, parameters, arguments = LAWS[use.law], parameters_of(use), arguments_of(use)
    function = law.validity.holds if holds and law.validity else law.function

    def traced(*values: Any) -> Any:
        return function(**dict(zip(arguments, values, strict=True)), **parameters)

    closed = jax.make_jaxpr(traced)(*([np.float64(1.0)] * len(arguments)))
    translation = _Translation(language, use.law)
    (result,) = translation.function(closed.jaxpr, closed.consts, own)
    wanted, kept = set(re.findall(r"\bv\d+\b", result)), []
    for name, line in reversed(translation.lines):
        if name in wanted:
            wanted |= set(re.findall(r"\bv\d+\b", line))
            kept.append(line)
    return kept[::-1], result


@dataclass(frozen=True)
class _Translation:
    """The lines of one law as they come."""

    language: Language
    law: str
    lines: list[tuple[str, str]] = field(default_factory=list)  # what a line names, the line
    counter: Iterator[int] = field(default_factory=count)

    def function(self, jaxpr: Any, consts: Any, given: Sequence[str]) -> list[str]:
        """Append the lines of a traced function; returns the names of its results."""
        return self._inside(jaxpr, consts, given, {})

    def _inside(self, jaxpr: Any, consts: Any, given: Sequence[str], tables: dict[Any, np.ndarray]) -> list[str]:
        """The same of an inner function, which is written in place; its tables may be those of the outer one."""
        names: dict[Any, str] = dict(zip(jaxpr.invars, given, strict=True))
        for variable, value in zip(jaxpr.constvars, consts, strict=True):
            array = np.asarray(value)
            if array.ndim:
                tables[variable] = array
            else:
                names[variable] = self._literal(array)

        def read(atom: Any) -> str:
            return self._literal(atom.val) if hasattr(atom, "val") else names[atom]

        for equation in jaxpr.eqns:
            inner = equation.params.get("jaxpr") or equation.params.get("call_jaxpr")
            if inner is not None and _INTERPOLATION in str(equation.params.get("name", "")):
                x, *lists = equation.invars[:3]
                at, values = (np.asarray(a.val) if hasattr(a, "val") else tables[a] for a in lists)
                results = [self._table(at, values, read(x))]
            elif inner is not None:
                results = self._called(inner, equation, read, tables)
            else:
                boolean = equation.outvars[0].aval.dtype == np.bool_
                value = self._operation(equation.primitive.name, [read(a) for a in equation.invars], equation)
                results = [self._line(value, "int" if boolean else "real")]
            names |= dict(zip(equation.outvars, results, strict=True))
        return [read(v) for v in jaxpr.outvars]

    def _called(
        self, inner: Any, equation: Any, read: Callable[[Any], str], tables: dict[Any, np.ndarray]
    ) -> list[str]:
        """A function that is called, written in place."""
        body = getattr(inner, "jaxpr", inner)
        shared = [not hasattr(a, "val") and a in tables for a in equation.invars]
        known = ["" if s else read(a) for a, s in zip(equation.invars, shared, strict=True)]
        own = {i: tables[a] for i, a, s in zip(body.invars, equation.invars, shared, strict=True) if s}
        return self._inside(body, getattr(inner, "consts", ()), known, own)

    def _line(self, value: str, kind: str) -> str:
        name = f"v{next(self.counter)}"
        self.lines.append((name, self.language.line.format(kind=kind, name=name, value=value)))
        return name

    def _table(self, at: np.ndarray, values: np.ndarray, x: str) -> str:
        k, texts = next(self.counter), [[self.language.number(v) for v in row] for row in (at, values)]
        line = self.language.table.format(
            k=k,
            at=", ".join(texts[0]),
            values=", ".join(texts[1]),
            count=len(at),
            x=x,
            low=texts[0][0],
            high=texts[0][-1],
        )
        self.lines.append((f"v{k}", line))
        return f"v{k}"

    def _literal(self, value: Any) -> str:
        array = np.asarray(value)
        return str(int(array)) if array.dtype == np.bool_ else self.language.number(float(array))

    def _operation(self, kind: str, a: list[str], equation: Any) -> str:
        language = self.language
        if kind in language.infix:
            return f"{a[0]} {language.infix[kind]} {a[1]}"
        if kind in language.calls:
            return f"{language.calls[kind]}({', '.join(a)})"
        if kind in language.forms:
            return language.forms[kind].format(*a)
        if kind in _SAME:
            return a[0]
        if kind in ("neg", "not"):
            return f"{'-' if kind == 'neg' else '!'}{a[0]}"
        if kind == "integer_pow":
            power, one = int(equation.params["y"]), language.number(1.0)
            product = f" {language.infix['mul']} ".join([a[0]] * abs(power)) or one
            return product if power >= 0 else f"{one} {language.infix['div']} ({product})"
        raise TwinError(f"law '{self.law}' uses the operation '{kind}', which has no line of code", "export",
                        "add it to twin/export/c/law_code.py")  # fmt: skip
