"""Mesh files for the printer: binary STL for one part, one 3MF with named parts, materials and colours."""

from __future__ import annotations

from pathlib import Path

import lib3mf
import numpy as np

from tubefoot.design.parts import Part
from tubefoot.design.surface import TriangleMesh
from tubefoot.records import write_whole

STL_MARK = "Tubefoot"
STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, mesh: TriangleMesh, name: str) -> Path:
    """The path of a binary STL file in mm.

    path : file to write
    mesh : closed surface
    name : goes into the file's header
    """
    facets = np.zeros(len(mesh.triangles), dtype=STL_FACET)
    facets["normal"] = mesh.normals
    facets["corners"] = mesh.corners
    header = f"{STL_MARK} {name}, mm".encode("ascii", "replace")[:80].ljust(80)
    return write_whole(path, header + np.uint32(len(facets)).tobytes() + facets.tobytes())


def remove_stale_stl(directory: Path, current: list[Path]) -> None:
    """Remove STL files of an earlier export, so that no part of another design is printed by mistake.

    directory : where the STL files are; files that Tubefoot did not write stay
    current : files of this export
    """
    for path in set(directory.glob("*.stl")) - set(current):
        with path.open("rb") as file:
            if file.read(len(STL_MARK)) == STL_MARK.encode():
                path.unlink()


def write_3mf(path: Path, title: str, parts: list[Part]) -> Path:
    """The path of a 3MF file in mm: every part as a named object with its material, placed as assembled.

    Materials are base materials with a display colour; parts that are only in the gripper are left out.

    path : file to write
    title : goes into the file's metadata
    parts : parts of one finger
    """
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    about = model.GetMetaDataGroup()
    about.AddMetaData("", "Title", title, "xs:string", True)
    about.AddMetaData("", "Application", "Tubefoot", "xs:string", True)
    materials = model.AddBaseMaterialGroup()
    known: dict[str, int] = {}
    for part in parts:
        if not part.shifts:
            continue
        if part.material not in known:
            red, green, blue = part.colour
            colour = wrapper.FloatRGBAToColor(red, green, blue, 1.0)
            known[part.material] = materials.AddMaterial(part.material, colour)
        body = model.AddMeshObject()
        body.SetName(part.name)
        body.SetGeometry(
            [lib3mf.Position(tuple(map(float, point))) for point in part.mesh.points],
            [lib3mf.Triangle(tuple(map(int, triangle))) for triangle in part.mesh.triangles],
        )
        body.SetObjectLevelProperty(materials.GetResourceID(), known[part.material])
        for shift in part.shifts:
            model.AddBuildItem(body, _placed(wrapper.GetIdentityTransform(), shift))
    writer = model.QueryWriter("3mf")
    return write_whole(path, bytes(writer.WriteToBuffer()))


def _placed(transform: object, shift: tuple[float, float, float]) -> object:
    for axis, value in enumerate(shift):
        transform.Fields[3][axis] = float(value)  # type: ignore[attr-defined]
    return transform
