"""The poses and runs of plan-poses, measured on an arm whose sag no masses tell: accepted; wrong files are not."""

import csv
from pathlib import Path

import numpy as np
import pytest
from arms import ROOT, Site, identify_arm
from planned_arms import PlannedArm, measured, planned

from compgen.core.exceptions import InputError
from compgen.core.units import MDEG
from compgen.pipelines.files.robot_file import load_arm
from compgen.pipelines.measure.identification_files import MeasurementFiles, read_measurements


@pytest.fixture(scope="module")
def site():
    nominal = load_arm(str(ROOT / "robots" / "m710ic50.toml"))
    place = Site(1, nominal.robot)
    place.arm = PlannedArm(1)
    return nominal, place


@pytest.fixture(scope="module")
def files(site, tmp_path_factory):
    rng = np.random.default_rng(43)
    folder = tmp_path_factory.mktemp("measured")
    return [measured(site[1], asked, f"{name}.csv", folder, rng) for name, asked in zip("pr", planned(), strict=True)]


def identified(nominal, files):
    data, _ = read_measurements(nominal, MeasurementFiles(poses=files), force=False)
    return identify_arm(nominal, data, False)


def test_runs_beside_poses_are_accepted_where_the_model_leaves_much(site, files):
    """Sag is not in the model: some 30 um are left from posture to posture, and 10 within a run."""
    nominal, place = site
    result = identified(nominal, files)
    assert not result.refused
    assert result.selected.fit.noise > 20e-6
    source = next(k.source for k in result.known if k.source.NAME == "hysteresis")
    assert source.law == "play"
    assert np.abs(source.backlash - place.arm.play)[[0, 1]].max() < 0.5 * MDEG


def rewritten(file, folder, change):
    rows = list(csv.DictReader(Path(file).read_text().splitlines()))
    for row in rows:
        change(row)
    target = folder / "wrong.csv"
    with target.open("w", newline="") as out:
        writer = csv.DictWriter(out, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    return str(target)


def swap(a, b):
    def change(row):
        row[a], row[b] = row[b], row[a]

    return change


def in_metres(row):
    row.update({k: f"{float(row[k]) / 1000:.7f}" for k in ("x_mm", "y_mm", "z_mm")})


def other_sign(row):
    row["j4_deg"] = str(-float(row["j4_deg"]))


def other_reflector(row):
    row["target"] = {"r1": "r2", "r2": "r3", "r3": "r1"}[row["target"]]


@pytest.mark.parametrize(
    "change",
    [swap("x_mm", "y_mm"), swap("j4_deg", "j6_deg"), in_metres, other_sign, other_reflector],
    ids=["swapped columns", "J4 and J6", "metres", "sign of J4", "another reflector"],
)
def test_wrong_runs_beside_right_poses_are_refused(site, files, tmp_path, change):
    nominal, _ = site
    try:
        result = identified(nominal, [files[0], rewritten(files[1], tmp_path, change)])
    except InputError:
        return
    assert result.refused, [f.message for f in result.findings]


@pytest.mark.parametrize("change", [swap("j2_deg", "j4_deg"), in_metres], ids=["J2 and J4", "metres"])
def test_wrong_poses_beside_right_runs_are_refused(site, files, tmp_path, change):
    nominal, _ = site
    try:
        result = identified(nominal, [rewritten(files[0], tmp_path, change), files[1]])
    except InputError:
        return
    assert result.refused, [f.message for f in result.findings]
