"""Each rule passes the reference finger and fails the design that breaks it, with the measured value."""

import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.design.judge import judged_file, require_printable
from tubefoot.design.printability import check_rules
from tubefoot.design.rules import Rule, broken
from tubefoot.errors import GeometryError

BROKEN_BY = {
    "sealing width, chamber to outside": ("bellows", {"fold_wall_mm": 0.9}, 0.9),
    "sealing width, chamber to chamber": ("bellows", {"partition_mm": 0.8}, 0.8),
    "sealing width, chamber to cap end": ("printing", {"min_seal_mm": 4.5}, 4.0),
    "side wall": ("bellows", {"side_wall_mm": 0.5}, 0.5),
    "tube wall": ("ports", {"bore_mm": 2.4}, 0.5),
    "cap beside the tube": ("ports", {"axis_mm": 3.0, "outer_diameter_mm": 5.0}, 0.5),
    "thinnest wall in a growth-compensated file": ("printing", {"growth_mm": 0.2}, 0.3),
    "fold slot as printed": ("bellows", {"crest_flat_mm": 3.1}, 0.34059),
    "support removal: opening of a fold slot": ("printing", {"tool_mm": 1.6}, 1.54059),
    "support removal: opening of the chamber": ("printing", {"tool_mm": 3.1}, 3.0),
    "support removal: height of the chamber": ("printing", {"tool_mm": 6.1}, 6.0),
    "support removal: bore of the tubes": ("ports", {"bore_mm": 0.7}, 0.7),
    "bore as printed": ("ports", {"bore_mm": 0.7}, 0.4),
    "valley between folds as printed": ("bellows", {"valley_flat_mm": 0.6}, 0.3),
    "pin in a growth-compensated file": ("registration", {"pin_diameter_mm": 0.6}, 0.3),
    "bonding face between pin hole and tube": ("registration", {"pin_diameter_mm": 1.8}, 0.3),
    "bonding face between pin hole and cap end": ("bellows", {"cap_mm": 2.0}, 0.3),
    "wall behind the pin hole": ("registration", {"pin_height_mm": 4.0}, 0.3),
    "lip in a growth-compensated file": ("registration", {"lip_width_mm": 0.6}, 0.3),
    "bonding face beside the groove": ("registration", {"lip_width_mm": 1.2}, 0.3),
    "wall behind the groove": ("registration", {"lip_height_mm": 4.0}, 0.4),
    "hose: stretch over the tube": ("ports", {"hose_bore_mm": 3.4}, 0.0),
    "hose: wall": ("ports", {"hose_outer_mm": 4.0}, 0.5),
    "hoses beside each other: stretched diameter": ("ports", {"hose_outer_mm": 6.0}, 6.2097),
    "hose on a bottom tube, below the base": ("ports", {"length_mm": 6.0}, 3.0),
    "connector on a top tube": ("ports", {"connector_length_mm": 8.0}, 3.0),
    "connector beyond the tube's free length": ("ports", {"connector_length_mm": 14.0}, 9.0),
    "plug in its connector": ("ports", {"plug_length_mm": 3.0, "connector_length_mm": 10.0}, 3.0),
    "base between its tube holes": ("base", {"tube_clearance_mm": 1.1}, 0.4),
    "base socket: depth": ("base", {"socket_depth_mm": 4.2}, 4.2),
    "base socket: wall": ("base", {"socket_wall_mm": 0.5}, 0.5),
    "base screw: hole": ("base", {"screw_hole_mm": 5.5}, 5.5),
    "base plate": ("base", {"plate_mm": 1.5}, 1.5),
    "marker seats: highest unit": ("marker_seats", {"units": [2, 7]}, 7.0),
    "marker pad: length": ("marker_seats", {"pad_length_mm": 4.5}, 4.5),
    "marker plate above the base": ("marker_seats", {"units": [1]}, -2.17),
    "marker plate: web between pocket and tag": ("marker_seats", {"plate_mm": 1.2}, 0.5),
    "marker plate: pocket over pad height": ("marker_seats", {"pocket_mm": 1.0, "plate_mm": 2.0}, 1.0),
    "marker seats: spacing": ("marker_seats", {"units": [2, 3]}, 7.0),
    "module length with tubes": ("bellows", {"units": 40}, 304.0),
    "module width": ("printing", {"tray_mm": [100.0, 20.0, 20.0]}, 22.0),
    "gripper base length": ("gripper", {"finger_gap_mm": 200.0}, 238.2),
}


@pytest.mark.parametrize("name", BROKEN_BY)
def test_a_rule_fails_the_design_that_breaks_it(name):
    section, keys, value = BROKEN_BY[name]
    tray = {"tray_mm": [230.0, 230.0, 200.0]} if name == "gripper base length" else {}
    design = FingerDesign.model_validate({section: keys, **({"printing": tray} if tray else {})})
    faults = [rule for rule in broken(check_rules(design)) if rule.name == name]
    assert faults, [rule.sentence for rule in broken(check_rules(design))]
    assert faults[0].value == pytest.approx(value, rel=1e-4, abs=1e-9)
    assert faults[0].advice in faults[0].sentence


def test_every_printability_rule_is_tried_here():
    from tubefoot.design.printability import printability_rules

    names = {rule.name for rule in printability_rules(FingerDesign())}
    assert names - {"gripper base: gap between the sockets"} == set(BROKEN_BY)


def test_overlapping_sockets_need_no_gap_but_a_sliver_is_refused():
    for gap, refused in ((0.0, False), (-1.0, None), (6.0 - 0.2, False)):
        if refused is None:
            continue
        design = FingerDesign.model_validate({"gripper": {"finger_gap_mm": gap}})
        names = [rule.name for rule in broken(check_rules(design))]
        assert ("gripper base: gap between the sockets" in names) == refused
    narrow = FingerDesign.model_validate(
        {"bellows": {"fold_run_mm": 2.25}, "gripper": {"finger_gap_mm": 0.0}}
    )
    assert any(rule.name.startswith("gripper base: gap") for rule in broken(check_rules(narrow)))


@pytest.mark.parametrize("units", [3, 6, 12])
def test_the_reference_fingers_pass_every_rule(units):
    assert broken(check_rules(FingerDesign().with_bellows(units=units))) == []


def test_a_rule_keeps_its_limit_up_to_rounding_only():
    def rule(value, sense):
        return Rule("wall", value, 0.3, sense, "mm", "raise it")

    assert rule(0.1 + 0.2, "<=").passed
    assert rule(0.3, ">=").passed
    assert not rule(0.2999, ">=").passed
    assert not rule(0.3001, "<=").passed
    assert rule(0.2999, ">=").sentence == "wall is 0.2999 mm, must be >= 0.3 mm; raise it"
    assert rule(0.4, ">=").sentence == "wall is 0.4 mm, must be >= 0.3 mm"


def test_every_rule_of_the_section_has_a_place_on_the_finger():
    design = FingerDesign()
    length = design.profile.bellows_length
    for rule in check_rules(design):
        if rule.name.startswith(("module", "gripper base length")):
            continue
        assert rule.place is not None, rule.name
        assert abs(rule.place[0]) <= 12.0
        assert -15.0 <= rule.place[1] <= length + 15.0


def test_an_impossible_file_is_judged_by_its_geometry(tmp_path):
    path = tmp_path / "thick.toml"
    path.write_text('name = "thick"\n[bellows]\nvalley_outside_mm = 3.0\n')
    judged = judged_file(path)
    assert judged.design is None
    assert judged.name == "thick"
    assert {"chamber gap", "port bore"} <= {rule.name for rule in judged.faults}


def test_export_is_refused_with_every_reason():
    design = FingerDesign.model_validate({"bellows": {"side_wall_mm": 0.5}, "ports": {"length_mm": 6.0}})
    with pytest.raises(GeometryError) as caught:
        require_printable(design)
    assert "side wall is 0.5 mm, must be >= 0.6 mm; raise bellows.side_wall_mm" in str(caught.value)
    assert "hose on a bottom tube" in str(caught.value)
