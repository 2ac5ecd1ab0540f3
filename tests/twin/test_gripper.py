"""The gripper's scene: statics of finger and object against closed forms and the reduced finger without a
simulator."""

import mujoco
import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.lab.grasp_object import GraspObject, Pose, known_object
from tubefoot.reduced.files import reference_file
from tubefoot.twin.grip_state import grip_states
from tubefoot.twin.gripper import Gripper
from tubefoot.twin.gripper_hands import SlipGauge
from tubefoot.twin.gripper_scene import GripperMake, SceneParts, compiled_scene
from tubefoot.twin.held_object import HeldObject
from tubefoot.units import DEG

FINGER = reference_file().to_finger()
TOFU, BERRY = known_object("tofu"), known_object("blueberry")


def gripper_of(
    what: GraspObject, pose: Pose = "front", friction: float = 0.5, gravity: bool = True
) -> Gripper:
    """A gripper of two reference fingers about an object."""
    parts = SceneParts((FINGER, FINGER), GripperMake(), HeldObject(what, pose, friction))
    return Gripper(parts, gravity=gravity)


def stand(gripper: Gripper, pressures: tuple[float, float], seconds: float) -> None:
    """Let time pass at given chamber pressures [MPa]."""
    for _ in range(round(seconds / 2e-3)):
        for finger in gripper.fingers:
            finger.advance(*pressures, 2e-3)


@pytest.mark.parametrize("pose", ["front", "side"])
def test_block_shortens_as_a_bar(pose: Pose) -> None:
    """Two forces on the plates: F L / (E A), to the integrator's rest."""
    gripper = gripper_of(TOFU, pose, gravity=False)
    model, data = gripper.model, gripper.data
    gripper.place((0.0, 0.0, 200.0))
    force = 0.05
    plates = [model.body(f"object_{side}").id for side in ("right", "left")]
    apart = data.xpos[plates[0], 0] - data.xpos[plates[1], 0]
    for plate, way in zip(plates, (-1.0, 1.0), strict=True):
        data.xfrc_applied[plate, 0] = way * force
    for _ in range(1500):
        mujoco.mj_step(model, data)
    shortened = 1e3 * (apart - (data.xpos[plates[0], 0] - data.xpos[plates[1], 0]))
    length = TOFU.sizes(pose)[0]
    assert shortened == pytest.approx(force * length / (TOFU.modulus * TOFU.face_area(pose)), rel=0.01)


def test_grip_at_rest_is_in_equilibrium_with_the_reduced_finger() -> None:
    """The reduced finger alone, its force and height taken from the scene, shows the same angles.

    Left is the bent finger's geometry in the arms: 0.25 deg.
    """
    (state,) = grip_states(BERRY, "front", [0.3])
    middles = FINGER.cap + FINGER.pitch * (np.arange(12) + 0.5)
    arms = np.maximum(state.contact_height_mm - middles, 0.0)
    across = (state.normal_force_n**2 - state.vertical_force_n**2) ** 0.5
    moments = -across * arms + FINGER.half_width * state.vertical_force_n * (arms > 0)
    alone = FINGER.equilibrium(np.array([300.0, -300.0]), moments=moments)
    assert state.theta1_deg == pytest.approx(alone.angles[:6].sum() / DEG, abs=0.25)
    assert state.theta2_deg == pytest.approx(alone.angles[6:].sum() / DEG, abs=0.25)
    assert state.pressure_right_kpa == pytest.approx(1e3 * alone.pressures[0], abs=0.2)


def test_grip_grows_with_volume_and_theta2_changes_its_sign() -> None:
    first, second, third = grip_states(TOFU, "front", [-0.1, 0.1, 0.4])
    assert first.normal_force_n < second.normal_force_n < third.normal_force_n
    assert first.theta1_deg < 0
    assert first.theta2_deg < 0 < third.theta2_deg


def test_contact_gives_way_as_wall_and_object_in_series() -> None:
    """A sphere between the straight fingers: force over depth of each contact."""
    ball = BERRY.model_copy(update={"shape": "sphere", "size_mm": (8.6, 8.6, 8.6)})
    gripper = gripper_of(ball, gravity=False)
    gripper.place((0.0, 0.0, 7.5 + 3.5 + 1.5))
    stand(gripper, (0.0, 0.0), 1.0)
    contact = gripper.data.contact
    depths = [-1e3 * float(contact.dist[n]) for n in range(gripper.data.ncon)]
    right, left = gripper.touches()
    assert right.points == left.points == 1
    stiffness = 1.0 / (1.0 / (0.5 * GripperMake().wall_n_per_mm) + 1.0 / (2 * 1.34))
    assert right.normal / max(depths) == pytest.approx(stiffness, rel=0.05)


def test_both_fingers_press_alike() -> None:
    gripper = gripper_of(TOFU, gravity=False)
    gripper.place((0.0, 0.0, 70.0))
    stand(gripper, (0.0, 0.0), 1.0)
    right, left = gripper.touches()
    assert right.normal == pytest.approx(left.normal, rel=1e-3)
    assert right.force[0] == pytest.approx(-left.force[0], rel=1e-3)


def test_pressures_alone_bend_it_as_the_reduced_finger() -> None:
    gripper = gripper_of(BERRY, gravity=False)
    stand(gripper, (10e-3, -10e-3), 3.0)
    expected = FINGER.free_bending(np.array([10e-3, -10e-3])).bend
    for finger in gripper.fingers:
        assert finger.bend == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(("share", "held"), [(1.4, True), (0.5, False)])
def test_friction_decides_between_hold_and_fall(share: float, held: bool) -> None:
    """A flank that leans inward by psi pushes down: what holds is a friction of tan(psi + W / (2 N)).

    share : friction over that
    """
    gripper = gripper_of(BERRY)
    gripper.place((0.0, 0.0, 70.0))
    stand(gripper, (20e-3, -20e-3), 1.0)
    right, left = gripper.touches()
    lean = float(gripper.fingers[0].unit_angles[:10].sum())
    needed = np.tan(lean + BERRY.weight / (right.normal + left.normal))
    gripper.model.pair_friction[:, :2] = share * needed
    gauge = SlipGauge(gripper)
    gripper.release()
    gauge.begin()
    stand(gripper, (20e-3, -20e-3), 1.5)
    assert (gauge.now() < 0.5) == held


def test_carried_up_everything_is_heavier() -> None:
    """The hand's hold bears m (g + a) of the object."""
    gripper = gripper_of(BERRY)
    gripper.place((0.0, 0.0, 300.0))
    for acceleration in (0.0, 4000.0):
        gripper.accelerate((0.0, 0.0, acceleration))
        stand(gripper, (0.0, 0.0), 0.5)
        start = int(gripper.model.joint("object").dofadr[0])
        borne = gripper.data.qfrc_constraint[start + 2]
        assert borne == pytest.approx(1e3 * BERRY.mass * (9.80665 + acceleration / 1e3), rel=1e-3)


def test_mesh_is_scaled_to_its_sizes(tmp_path: object) -> None:
    """A tetrahedron in the file's unit becomes as large as the record says."""
    from pathlib import Path

    file = Path(str(tmp_path)) / "wedge.obj"
    file.write_text("v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    thing = GraspObject.model_validate(
        {"name": "wedge", "shape": "mesh", "mesh_file": str(file), "size_mm": (10, 12, 14), "mass_g": 2.0}
        | {"modulus_kpa": 500, "damage": {"contact_force_n": 1.0}}
    )
    model = compiled_scene(SceneParts((FINGER, FINGER), GripperMake(), HeldObject(thing, "front", 0.5)))
    geom = model.geom("object")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    points = model.mesh_vert @ turn.reshape(3, 3).T + geom.pos
    assert 1e3 * np.ptp(points, axis=0) == pytest.approx([10, 12, 14], rel=1e-4)
    assert 1e3 * (points.min(axis=0) + points.max(axis=0)) / 2 == pytest.approx([0, 0, 0], abs=1e-3)


def test_a_file_that_is_no_mesh_is_refused(tmp_path: object) -> None:
    from pathlib import Path

    file = Path(str(tmp_path)) / "no.obj"
    file.write_text("nothing\n")
    thing = TOFU.model_copy(update={"shape": "mesh", "mesh_file": str(file), "mass_g": 2.0})
    with pytest.raises(ConfigError, match="give a closed mesh"):
        HeldObject(thing, "front", 0.5).assets()
