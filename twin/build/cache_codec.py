"""Data of the package as a structure of plain JSON and a list of arrays, and back, without running code of an entry.

What can be kept: None, bool, int, float, str; tuples, lists, dicts; numpy arrays and numbers of these kinds; sparse
matrices by rows or columns; frozen or other dataclasses that are defined in this package, field by field. Nothing else:
no functions, no classes as values, no objects of other packages. An object that is met twice is kept once and is one
object again after reading, as are its arrays.

Nodes of the structure: a plain value stands for itself, [..] is a list, and everything else is {kind: content}:
{"tuple": [node..]}, {"dict": [[node, node]..]}, {"array": i}, {"number": i}, {"sparse": [class, shape, i, i, i]} and
{"object": k}, with objects = [[class, [node..]]..], each after the ones it refers to.
"""

from __future__ import annotations

import importlib
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

PACKAGE = "twin."
KINDS = "biufcUS"  # of numpy: numbers and text; others could hold Python objects
SPARSE = {c.__name__: c for c in (sp.csr_array, sp.csc_array, sp.csr_matrix, sp.csc_matrix)}


def encode(value: Any) -> tuple[dict[str, Any], list[np.ndarray]]:
    """A structure that `json` can write, and the arrays it refers to. Raises TypeError for what cannot be kept."""
    encoder = _Encoder()
    root = encoder.node(value)
    return {"root": root, "objects": encoder.objects}, encoder.arrays


def decode(structure: dict[str, Any], arrays: list[np.ndarray]) -> Any:
    """What `encode` was given.

    Dataclasses are filled without a call of their `__init__` or `__post_init__`. Raises TypeError or ValueError for a
    class that is no dataclass of this package or has other fields now, and KeyError, IndexError and the like for a
    structure that `encode` did not make.
    """
    decoder = _Decoder(arrays)
    for name, content in structure["objects"]:
        decoder.objects.append(decoder.instance(name, content))
    return decoder.value(structure["root"])


class _Encoder:
    def __init__(self) -> None:
        self.objects: list[list[Any]] = []
        self.arrays: list[np.ndarray] = []
        self._seen: dict[int, dict[str, Any]] = {}
        self._held: list[Any] = []  # what `_seen` knows by its address must live as long

    def node(self, value: Any) -> Any:
        kind = type(value)
        if value is None or kind in (bool, int, float, str):
            return value
        if kind is list:
            return [self.node(v) for v in value]
        if kind is tuple:
            return {"tuple": [self.node(v) for v in value]}
        if kind is dict:
            return {"dict": [[self.node(k), self.node(v)] for k, v in value.items()]}
        if isinstance(value, np.generic):
            return {"number": self._array(np.asarray(value))}
        if id(value) not in self._seen:
            self._held.append(value)
            self._seen[id(value)] = self._new(value)
        return self._seen[id(value)]

    def _new(self, value: Any) -> dict[str, Any]:
        kind = type(value)
        if kind is np.ndarray:
            return {"array": self._array(value)}
        if SPARSE.get(kind.__name__) is kind:
            parts = [self.node(part)["array"] for part in (value.data, value.indices, value.indptr)]
            return {"sparse": [kind.__name__, [int(n) for n in value.shape], *parts]}
        if is_dataclass(kind) and _known(kind):
            content = [self.node(getattr(value, field.name)) for field in fields(kind)]
            self.objects.append([f"{kind.__module__}:{kind.__name__}", content])
            return {"object": len(self.objects) - 1}
        raise TypeError(f"{kind.__module__}.{kind.__qualname__} is no data that the cache keeps")

    def _array(self, array: np.ndarray) -> int:
        if array.dtype.kind not in KINDS:
            raise TypeError(f"an array of {array.dtype} is no data that the cache keeps")
        self.arrays.append(array)
        return len(self.arrays) - 1


class _Decoder:
    def __init__(self, arrays: list[np.ndarray]) -> None:
        self.objects: list[Any] = []
        self._arrays = arrays

    def value(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self.value(n) for n in node]
        if not isinstance(node, dict):
            return node
        ((kind, content),) = node.items()
        if kind == "tuple":
            return tuple(self.value(n) for n in content)
        if kind == "dict":
            return {self.value(k): self.value(v) for k, v in content}
        if kind == "array":
            return self._arrays[content]
        if kind == "number":
            return self._arrays[content][()]
        if kind == "object":
            return self.objects[content]
        if kind == "sparse":
            return self._sparse(*content)
        raise ValueError(f"no kind of data: {kind}")

    def instance(self, name: str, content: list[Any]) -> Any:
        kind = _class(name)
        result: Any = object.__new__(kind)
        for field, node in zip(fields(kind), content, strict=True):
            object.__setattr__(result, field.name, self.value(node))
        return result

    def _sparse(self, name: str, shape: list[int], data: int, indices: int, indptr: int) -> Any:
        kind = SPARSE[name]
        own = [self._arrays[i] for i in (data, indices, indptr)]
        matrix = kind((own[0], own[1], own[2]), shape=tuple(shape))
        matrix.check_format(full_check=True)  # compiled code reads wherever the indices point
        matrix.indices, matrix.indptr = own[1], own[2]  # in the width they had
        return matrix


def _known(kind: type) -> bool:
    """Whether a class can be found again by its module and name."""
    module = importlib.import_module(kind.__module__) if kind.__module__.startswith(PACKAGE) else None
    return getattr(module, kind.__name__, None) is kind


def _class(name: str) -> type:
    """A dataclass of this package. Raises TypeError for any other, without importing its module."""
    module, _, own = name.partition(":")
    if not module.startswith(PACKAGE):
        raise TypeError(f"{name} is no class of this package")
    kind = getattr(importlib.import_module(module), own)
    if not (isinstance(kind, type) and is_dataclass(kind) and kind.__module__ == module):
        raise TypeError(f"{name} is no dataclass of this package")
    return kind
