"""modelDescription.xml of both versions of FMI."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from twin.export.fmu.variables import Variable

Element = ET.Element
# unit -> exponents of SI base units, factor and offset to them
_BASE: dict[str, dict[str, str]] = {
    "degC": {"K": "1", "offset": "273.15"}, "K": {"K": "1"}, "m": {"m": "1"}, "s": {"s": "1"}, "1": {},
    "m/s": {"m": "1", "s": "-1"}, "1/s": {"s": "-1"}, "A": {"A": "1"}, "rad": {"rad": "1"},
    "rad/s": {"rad": "1", "s": "-1"}, "W": {"kg": "1", "m": "2", "s": "-3"}, "N": {"kg": "1", "m": "1", "s": "-2"},
    "N*m": {"kg": "1", "m": "2", "s": "-2"}, "m^3/s": {"m": "3", "s": "-1"}, "Pa": {"kg": "1", "m": "-1", "s": "-2"},
    "V": {"kg": "1", "m": "2", "s": "-3", "A": "-1"},
}  # fmt: skip


def description2(name: str, token: str, variables: Sequence[Variable], about: dict[str, str]) -> bytes:
    """Of FMI 2.0; the independent variable is left out."""
    own = {"fmiVersion": "2.0", "modelName": name, "guid": token, "variableNamingConvention": "flat"}
    root = ET.Element("fmiModelDescription", {**own, "numberOfEventIndicators": "0", **about})
    simulation = ET.SubElement(
        root, "CoSimulation", modelIdentifier=name, canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUstate="true", canSerializeFMUstate="true", canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    ET.SubElement(ET.SubElement(simulation, "SourceFiles"), "File", name="fmi2.c")
    _put_units(root, variables, "UnitDefinitions")
    categories = ET.SubElement(root, "LogCategories")
    for category in ("logStatusError", "logStatusWarning"):
        ET.SubElement(categories, "Category", name=category)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stepSize=about_step(variables))
    listed = ET.SubElement(root, "ModelVariables")
    outputs = []
    for reference, v in enumerate(variables):
        if not v.listed:
            continue
        entry = ET.SubElement(listed, "ScalarVariable", name=v.name, valueReference=str(reference),
                              description=v.description, causality=v.causality, variability=v.variability)  # fmt: skip
        if v.causality == "output":
            outputs.append(len(listed))
            entry.set("initial", "calculated")
        elif v.causality == "parameter":
            entry.set("initial", "exact")
        real = ET.SubElement(entry, "Real", unit=v.unit)
        if v.start is not None:
            real.set("start", repr(float(v.start)))
    structure = ET.SubElement(root, "ModelStructure")
    for kind in ("Outputs", "InitialUnknowns"):
        group = ET.SubElement(structure, kind) if outputs else structure
        for index in outputs:
            ET.SubElement(group, "Unknown", index=str(index))
    return _bytes(root)


def description3(name: str, token: str, variables: Sequence[Variable], about: dict[str, str]) -> bytes:
    """Of FMI 3.0."""
    own = {"fmiVersion": "3.0", "modelName": name, "instantiationToken": token, "variableNamingConvention": "flat"}
    root = ET.Element("fmiModelDescription", {**own, **about})
    ET.SubElement(
        root, "CoSimulation", modelIdentifier=name, canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true", canSerializeFMUState="true",
    )  # fmt: skip
    _put_units(root, variables, "UnitDefinitions")
    categories = ET.SubElement(root, "LogCategories")
    for category in ("logStatusError", "logStatusWarning"):
        ET.SubElement(categories, "Category", name=category)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stepSize=about_step(variables))
    listed, outputs = ET.SubElement(root, "ModelVariables"), []
    for reference, v in enumerate(variables):
        if not v.listed:
            continue
        entry = ET.SubElement(listed, "Float64", name=v.name, valueReference=str(reference),
                              description=v.description, causality=v.causality, variability=v.variability,
                              unit=v.unit)  # fmt: skip
        if v.causality == "output":
            outputs.append(reference)
            entry.set("initial", "calculated")
        elif v.causality == "parameter":
            entry.set("initial", "exact")
        if v.start is not None:
            entry.set("start", repr(float(v.start)))
    structure = ET.SubElement(root, "ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        for reference in outputs:
            ET.SubElement(structure, kind, valueReference=str(reference))
    return _bytes(root)


def build_description3(name: str) -> bytes:
    """sources/buildDescription.xml of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    ET.SubElement(files, "SourceFile", name="fmi3.c")
    return _bytes(root)


def about_step(variables: Sequence[Variable]) -> str:
    return next(repr(float(v.start or 0.0)) for v in variables if v.name == "step")


def _put_units(root: Element, variables: Sequence[Variable], group: str) -> None:
    units = ET.SubElement(root, group)
    for unit in dict.fromkeys(v.unit for v in variables if v.listed):
        entry = ET.SubElement(units, "Unit", name=unit)
        if unit in _BASE:
            ET.SubElement(entry, "BaseUnit", _BASE[unit])


def _bytes(root: Element) -> bytes:
    ET.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="utf-8") + b"\n"
