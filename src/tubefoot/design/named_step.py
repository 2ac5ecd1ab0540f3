"""STEP files in which every solid and every face bears a name, for programs that mesh or load them by name.

Like `cad`, this module knows the CAD kernel: import it only where solids are made.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import build123d as b3d
import numpy as np
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from tubefoot.design.cad import Solid, bodies, grouped
from tubefoot.design.surface import FloatArray
from tubefoot.errors import GeometryError


@dataclass(frozen=True)
class FacePlace:
    """Where a face of a solid lies [mm].

    low, high : its bounding box; point : a point on it; normal : out of the solid there
    is_plane : whether it is flat
    """

    low: FloatArray
    high: FloatArray
    point: FloatArray
    normal: FloatArray
    is_plane: bool


def face_place(face: Any) -> FacePlace:
    """Where a face lies.

    face : one of a solid's faces
    """
    box = face.bounding_box()
    point = face.position_at(0.5, 0.5)
    normal = face.normal_at(point)
    return FacePlace(
        np.array(tuple(box.min)),
        np.array(tuple(box.max)),
        np.array(tuple(point)),
        np.array(tuple(normal)),
        face.geom_type == b3d.GeomType.PLANE,
    )


def write_named_step(
    path: Path, named: Mapping[str, Solid], face_name: Callable[[str, FacePlace], str]
) -> Path:
    """The path of a STEP file in which every solid and every face bears a name.

    path : file to write
    named : name to solid
    face_name : name of a face, from the name of its solid and where it lies
    """
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    XCAFApp_Application.GetApplication_s().NewDocument(TCollection_ExtendedString("MDTV-XCAF"), document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    copies = {name: bodies(_rewritten(solid)) for name, solid in named.items()}
    whole = shapes.AddShape(
        b3d.Compound([body for group in copies.values() for body in group]).wrapped, False
    )

    def call(shape: Any, name: str) -> None:
        TDataStd_Name.Set_s(shapes.AddSubShape(whole, shape.wrapped), TCollection_ExtendedString(name))

    for name, group in copies.items():
        for body in group:
            call(body, name)
            for face in body.faces():
                call(face, face_name(name, face_place(face)))
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.part")
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(beside))
    if not beside.exists():
        raise GeometryError(f"{path}: the STEP file could not be written")
    beside.replace(path)
    return path


def _rewritten(solid: Solid) -> Solid:
    """The solid after writing and reading it.

    Then no face shares its geometry with another under a shift, which would cost it its name.
    """
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "solid.step"
        b3d.export_step(grouped(bodies(solid)), str(path))
        return b3d.import_step(str(path))
