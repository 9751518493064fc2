"""A frame from touches of a perfect arm: exact from centres and from sides, its covariance, and what is refused."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix, to_wpr
from compgen.core.units import DEG, MM, UM
from compgen.identification.model import build_model
from compgen.identification.part_frame_fit import fit_frame, measured_lengths, touches_of_part
from compgen.identification.touches import read_artefact, read_touches
from compgen.pipelines.files.robot_file import load_any_robot
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose

PROBE = Pose(np.array([10.0, -5.0, 140.0]) * MM, np.eye(3))
PLACES = np.array([[0.3, 0.3, 0.02], [0.3, -0.3, 0.0], [-0.3, 0.3, 0.05], [-0.3, -0.3, 0.01], [0.0, 0.0, 0.1]])
NAMES = "abcde"
EACH = 3
PART = Pose(np.array([1.2, 0.05, 0.1]), from_wpr(*(np.array([a * DEG]) for a in (1.0, -2.0, 25.0)))[0])


@pytest.fixture(scope="module")
def arm():
    return load_any_robot("m710ic50")


def artefact_text(places=PLACES, frame="world", unknown=(), **extra):
    lines = [
        "[artefact]",
        f'frame = "{frame}"',
        *(f"{k} = {v}" for k, v in extra.items()),
        "[probe]",
        "diameter_mm = 6",
    ]
    lines += [f"{k} = {v}" for k, v in zip(("x_mm", "y_mm", "z_mm"), PROBE.position / MM, strict=True)]
    for name, place in zip(NAMES, places / MM, strict=True):
        lines += ["[[sphere]]", f'name = "{name}"', "diameter_mm = 20"]
        lines += (
            [] if name in unknown else [f"{k} = {v:.9g}" for k, v in zip(("x_mm", "y_mm", "z_mm"), place, strict=True)]
        )
    return "\n".join(lines) + "\n"


def commanded(rng, sides, overtravel=0.0, noise=0.0, places=PLACES):
    """Poses of the ball: at the spheres' centres, or beside them along a direction; and these directions."""
    target = np.repeat(np.arange(5), EACH)
    centre = PART.act(places[target])
    normal = rng.normal(size=(len(target), 3)) * [1, 1, 0.3] - [0, 0, 0.4]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    position = centre - normal * (13 * MM - overtravel) if sides else centre
    rotation = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-0.4, 0.4, (len(target), 3)))
    return target, Pose(position + rng.normal(0, noise, position.shape), rotation), normal


def touches_text(arm, target, pose, normal=None, value=0.0, cartesian=False):
    head = ["target"]
    if cartesian:
        head += ["x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg", "config"]
        numbers = np.column_stack([pose.position / MM, *(np.ravel(a) / DEG for a in to_wpr(pose.rotation))])
    else:
        head += [f"j{k}_deg" for k in range(1, 7)]
        numbers = arm.to_pendant(solve_tool(arm, pose, PROBE, Posture())[0]) / DEG
    if normal is not None:
        head += ["nx", "ny", "nz", "value_mm"]
    rows, values = [",".join(head)], np.broadcast_to(value, len(target))
    for n, t in enumerate(target):
        cells = [NAMES[t], *(f"{v:.9f}" for v in numbers[n])]
        cells += ['"N U T, 0, 0, 0"'] if cartesian else []
        cells += [*(f"{v:.9f}" for v in normal[n]), f"{values[n] / MM:.9g}"] if normal is not None else []
        rows.append(",".join(cells))
    return "\n".join(rows) + "\n"


def fitted(tmp_path, arm, artefact, touches, uframes=None):
    (tmp_path / "artefact.toml").write_text(artefact)
    (tmp_path / "touches.csv").write_text(touches)
    known = read_artefact(str(tmp_path / "artefact.toml"))
    rows = read_touches(str(tmp_path / "touches.csv"), arm, known, uframes or {})
    return fitted_rows(arm, known, rows)


def fitted_rows(arm, known, rows):
    """By a perfect, cold arm whose joints came from nowhere."""
    return fit_frame(
        known, rows, build_model(arm, [], 0), touches_of_part(known, rows, np.zeros((len(rows.theta), 6)), 0)
    )


def assert_is_part(fit, atol=1e-8):
    assert_allclose(fit.frame.position, PART.position, atol=atol)
    assert_allclose(fit.frame.rotation, PART.rotation, atol=atol)


@pytest.mark.parametrize("cartesian", [False, True])
def test_centres_give_the_frame_exactly(tmp_path, arm, cartesian):
    target, pose, _ = commanded(np.random.default_rng(1), sides=False)
    fit = fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, pose, cartesian=cartesian))
    assert_is_part(fit)
    assert_allclose(fit.probe, PROBE.position, atol=1e-8)


def test_touches_from_one_side_and_deflections_give_the_frame(tmp_path, arm):
    rng = np.random.default_rng(2)
    target, pose, normal = commanded(rng, sides=True, overtravel=0.7 * MM)
    assert_is_part(fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, pose, normal, 0.7 * MM)), 1e-6)


def test_positions_may_be_commanded_in_a_user_frame(tmp_path, arm):
    target, pose, _ = commanded(np.random.default_rng(3), sides=False)
    frame = Pose(np.array([1.0, 0.2, -0.1]), rotation_matrix(np.array([[0.0, 0.0, 0.4]]))[0])
    text = touches_text(arm, target, frame.inverse() @ pose, cartesian=True)
    assert_is_part(fitted(tmp_path, arm, artefact_text(frame="uframe 2"), text, {2: frame}))
    with pytest.raises(InputError, match="--frames"):
        fitted(tmp_path, arm, artefact_text(frame="uframe 2"), text)


def test_a_sphere_of_unknown_place_is_no_harm_and_an_artefact_grows(tmp_path, arm):
    target, pose, _ = commanded(np.random.default_rng(4), sides=False)
    assert_is_part(fitted(tmp_path, arm, artefact_text(unknown="e"), touches_text(arm, target, pose)))
    warm = artefact_text(PLACES / (1 + 11.5e-6 * 10), cte_um_m_K=11.5, temperature_degC=30)
    assert_is_part(fitted(tmp_path, arm, warm, touches_text(arm, target, pose)))


@pytest.mark.parametrize(("noise", "shared"), [(20 * UM, 0.0), (5 * UM, 15 * UM)], ids=["each", "alike on a sphere"])
def test_the_uncertainty_is_what_repeating_gives(tmp_path, arm, noise, shared):
    off, told = [], []
    for seed in range(40):
        rng = np.random.default_rng(100 + seed)
        target, pose, _ = commanded(rng, sides=False, noise=noise)
        pose = Pose(pose.position + rng.normal(0, shared, (5, 3))[target], pose.rotation)
        fit = fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, pose))
        local = PART.inverse().act(fit.middle)
        longer = fit.flange @ (fit.probe - PROBE.position)  # has the part as much nearer, and meets it
        off.append((fit.frame.act(local) - fit.middle - longer) / fit.sigma[3:6])
        told.append(fit.noise)
    assert 0.75 < np.sqrt(np.mean(np.square(off))) < 1.3
    if not shared:
        assert np.sqrt(np.mean(np.square(told))) == pytest.approx(noise, rel=0.1)


def test_a_touch_far_off_is_set_aside(tmp_path, arm):
    target, pose, _ = commanded(np.random.default_rng(5), sides=False, noise=5 * UM)
    position = pose.position.copy()
    position[7] += [0, 0.4 * MM, 0]
    fit = fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, Pose(position, pose.rotation)))
    assert np.flatnonzero(fit.outlier).tolist() == [7]
    assert_is_part(fit, 50 * UM)


@pytest.mark.parametrize("off", [0.0, 0.4 * MM])
def test_one_touch_in_few_does_not_hide_in_the_noise_that_it_makes(tmp_path, arm, off):
    """Ten touches: 0.4 mm make 90 um of noise, and 4.5 of these are more than any touch can be off."""
    target, pose, _ = commanded(np.random.default_rng(5), sides=False, noise=5 * UM)
    two_each = np.arange(len(target)) % EACH < 2
    position = pose.position[two_each]
    position[7] += [0, off, 0]
    fit = fitted(
        tmp_path, arm, artefact_text(), touches_text(arm, target[two_each], Pose(position, pose.rotation[two_each]))
    )
    assert np.flatnonzero(fit.outlier).tolist() == [7] * (off > 0)
    assert fit.noise < 10 * UM
    assert_is_part(fit, 50 * UM)


def test_deflections_of_the_other_sign_are_a_misfit_and_no_line_of_spheres(tmp_path, arm):
    """Each is off by twice its deflection, 0 to 2 mm: the frame's turn is known the worse for it, by no line."""
    rng = np.random.default_rng(9)
    values = rng.uniform(0, 2 * MM, 5 * EACH)
    target, pose, normal = commanded(rng, sides=True, overtravel=values[:, None])
    assert_is_part(fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, pose, normal, values)), 1e-6)
    with pytest.raises(InputError, match=r"miss the spheres by \d\.\d mm .* the sign of value_mm"):
        fitted(tmp_path, arm, artefact_text(), touches_text(arm, target, pose, normal, -values))


def test_spheres_on_a_line_are_named_as_such_however_well_they_are_touched(tmp_path, arm):
    line = PLACES * [1, 0, 0] + [[0, 0, 0], [0.1, 0, 0], [0, 0, 0], [-0.1, 0, 0], [0, 1e-4, 0]]
    target, pose, _ = commanded(np.random.default_rng(10), sides=False, places=line, noise=10 * UM)
    with pytest.raises(InputError, match="lie on a line or near each other: the frame's turn is known to"):
        fitted(tmp_path, arm, artefact_text(line), touches_text(arm, target, pose))


def test_wrong_touches_are_refused_in_a_line(tmp_path, arm):
    target, pose, normal = commanded(np.random.default_rng(6), sides=False)
    good, touches = artefact_text(), touches_text(arm, target, pose)
    cases = [
        (good, touches.replace("\na,", "\nx,").replace("\nb,", "\na,").replace("\nx,", "\nb,"), "'a' and 'b' swapped"),
        (good, touches.replace("\ne,", "\nz,"), "is no sphere of"),
        (artefact_text(PLACES * 1e-3), touches, "check the spheres' places"),
        (artefact_text(PLACES * [[0, 1, 0]]), touches, "check the spheres' places"),
        (good, "\n".join(touches.splitlines()[:7]), "needs three"),
        (good, touches_text(arm, target, pose, 2 * normal), "length is 2, not 1"),
        (good.replace("diameter_mm = 20", ""), touches_text(arm, target, pose, normal), "diameter_mm: missing"),
        (good.replace("[probe]", "[prob]"), touches, "unknown key"),
        (good.replace('name = "b"', 'name = "a"'), touches, "stands twice"),
    ]
    for artefact, rows, words in cases:
        with pytest.raises(InputError) as refusal:
            fitted(tmp_path, arm, artefact, rows)
        assert words in str(refusal.value), (words, refusal.value)
        assert "\n" not in str(refusal.value)


def test_spheres_on_a_line_are_refused(tmp_path, arm):
    rng = np.random.default_rng(7)
    line = np.linspace(-0.3, 0.3, 5)[:, None] * [[1.0, 0.5, 0.0]]
    target, pose, _ = commanded(rng, sides=False)
    moved = Pose(PART.act(line[target]) + rng.normal(0, 10 * UM, (len(target), 3)), pose.rotation)
    with pytest.raises(InputError, match="line"):
        fitted(tmp_path, arm, artefact_text(line), touches_text(arm, target, moved))


@pytest.mark.parametrize("sides", [False, True])
def test_a_certified_length_that_the_arm_has_otherwise_is_said(tmp_path, arm, sides):
    """Spheres farther apart than their certificate: the arm's scale, or the artefact's temperature."""
    target, pose, normal = commanded(np.random.default_rng(8), sides=sides, noise=2 * UM)
    text = touches_text(arm, target, pose, normal if sides else None)
    apart = np.linalg.norm(PLACES[0] - PLACES[3]) / MM
    for wrong, count in ((0.0, 0), (0.05, 1)):
        length = f'[[length]]\nbetween = ["a", "d"]\nmm = {apart - wrong:.6f}\nsigma_um = 1\n'
        (tmp_path / "artefact.toml").write_text(artefact_text() + length)
        (tmp_path / "touches.csv").write_text(text)
        known = read_artefact(str(tmp_path / "artefact.toml"))
        rows = read_touches(str(tmp_path / "touches.csv"), arm, known, {})
        differences = measured_lengths(known, rows, fitted_rows(arm, known, rows), flange_pose(arm, rows.theta))
        assert len(differences) == count
        assert all(longer == pytest.approx(wrong * MM, rel=0.15) for _, longer in differences)


def test_an_artefact_that_is_not_there_is_asked_for(tmp_path):
    with pytest.raises(InputError, match=r"artefact\.toml: no such file; --artefact names the file"):
        read_artefact(str(tmp_path / "artefact.toml"))


def test_directions_out_of_the_spheres_are_refused(tmp_path, arm):
    """Their deflections would count to the other side: 1.4 mm of 0.7 mm."""
    for overtravel in (0.7 * MM, 3 * MM):
        target, pose, normal = commanded(np.random.default_rng(2), sides=True, overtravel=overtravel)
        text = touches_text(arm, target, pose, -normal, overtravel)
        with pytest.raises(InputError, match="nx, ny, nz: the direction points out of the target"):
            fitted(tmp_path, arm, artefact_text(), text)


@pytest.mark.parametrize(
    ("names", "places", "words"),
    [
        ("bacde", PLACES, "'a' and 'b' swapped"),
        ("abcde", PLACES * 1e-3, "check the spheres' places"),
    ],
    ids=["swapped", "metres"],
)
def test_touches_from_one_side_that_miss_the_spheres_are_not_told_that_their_directions_are_wrong(
    tmp_path, arm, names, places, words
):
    """*The direction points out of the target, at 11 of 24 touches* was said of good ones."""
    target, pose, normal = commanded(np.random.default_rng(2), sides=True)
    text = re.sub(
        r"(?m)^[a-e](?=,)", lambda name: names["abcde".index(name[0])], touches_text(arm, target, pose, normal)
    )
    with pytest.raises(InputError, match=r"the touches miss the spheres by .* mm") as refusal:
        fitted(tmp_path, arm, artefact_text(places), text)
    assert words in str(refusal.value)
