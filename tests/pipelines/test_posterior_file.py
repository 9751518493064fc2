"""The posterior beside a robot file: kept with it, and refused where it is not the one meant."""

import json
import shutil
import tomllib
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from campaign import robot_file
from numpy.testing import assert_allclose
from shipped import quiet
from synthetic import made_up, measured, random_theta, warming

from compgen.core.exceptions import InputError
from compgen.core.files import POSTERIOR
from compgen.error_model.posterior import (
    KnownParameter,
    ParameterPosterior,
    known_numbers,
    posterior_text,
    read_posterior,
)
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.identification.identify import identify
from compgen.identification.measurements import concatenate
from compgen.job.job import Cell
from compgen.job.uncertainty import quantities_of_cell
from compgen.pipelines.files.robot_file import load_arm, load_cell
from compgen.pipelines.measure.identification_files import identified_texts

POINTS = np.array([[0.0, 0, 0.15]])


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """A robot file of a warm made-up arm with its posterior beside it, and the identification that wrote them."""
    folder = tmp_path_factory.mktemp("posterior")
    truth = made_up(robot_file(folder), 3)
    rng = np.random.default_rng(5)
    cold = measured(truth, random_theta(truth.arm.robot, rng, 60), rng)
    data = concatenate([cold, warming(truth, rng)[0]])
    arm = load_arm(truth.arm.source)
    result = identify(arm.robot, arm.known, data, len(arm.nodes), quiet, temperatures=True, facts=arm.facts)
    text, posterior = identified_texts(arm, result, [truth.arm.source], f"mine{POSTERIOR}")
    (folder / "mine.toml").write_text(text)
    (folder / f"mine{POSTERIOR}").write_text(posterior)
    return folder, result


@pytest.fixture
def copied(identified, tmp_path):
    """The two files, to be damaged."""
    for name in ("mine.toml", f"mine{POSTERIOR}"):
        shutil.copy(identified[0] / name, tmp_path / name)
    return tmp_path


def damage(folder, change):
    """Change the posterior's record, and let the robot file name what comes of it."""
    file, robot = folder / f"mine{POSTERIOR}", folder / "mine.toml"
    old = sha256(file.read_bytes()).hexdigest()
    record = json.loads(file.read_text())
    change(record)
    file.write_text(json.dumps(record))
    robot.write_text(robot.read_text().replace(old, sha256(file.read_bytes()).hexdigest()))


def cell_with_posterior(folder: Path) -> tuple[Cell, ParameterPosterior]:
    cell = load_cell(str(folder / "mine.toml"))
    assert cell.posterior is not None
    return cell, cell.posterior


def test_sigmas_of_the_posterior_are_those_of_the_robot_file(identified):
    cell, posterior = cell_with_posterior(identified[0])
    sigmas = {k.source.NAME: k.sigma for k in cell.known}
    sources = [p for p in posterior.parameters if p.field in sigmas.get(p.table, {})]
    of_file = [sigmas[p.table][p.field][p.index] for p in sources]
    assert_allclose(posterior.sigma[: len(sources)], of_file, rtol=1e-7)
    assert len(sources) == sum(int((s > 0).sum()) for k in cell.known for s in k.sigma.values())
    assert {p.table for p in sources} >= {"thermal_growth", "thermal_bend", "link_offsets", "hysteresis"}


def test_the_posterior_moves_the_tool_as_the_fit_itself_says(identified):
    """The band of a place by the file, through the sources' own numbers, against that of the fit's linear problem."""
    folder, result = identified
    _, posterior = cell_with_posterior(folder)
    fit = result.selected.fit
    K = int(fit.active.sum())
    A = fit.linear.A[:, :, :K]
    of_fit = np.sqrt(np.einsum("nij,jk,nik->ni", A, fit.posterior.covariance[:K, :K], A))
    values = {p.name: i for i, p in enumerate(posterior.parameters)}
    names = [t.name for t in result.model.parameters]
    kept = [k for k in np.flatnonzero(fit.active).tolist() if not result.model.parameters[k].thermal]
    assert all(names[k] in values for k in kept)
    at = [values[names[k]] for k in kept]
    rows = [np.flatnonzero(fit.active).tolist().index(k) for k in kept]
    scaled = A[:, :, rows] / result.model.prior[kept]
    of_file = np.sqrt(np.einsum("nij,jk,nik->ni", scaled, posterior.covariance[np.ix_(at, at)], scaled))
    cold = result.data.rise[result.data.pose].max(axis=1) == 0
    assert_allclose(of_file[cold], of_fit[cold], rtol=0.01)
    alone = np.sqrt(np.einsum("nij,j,nij->ni", scaled, np.diag(posterior.covariance)[at], scaled))
    assert alone[cold].mean() > 1.5 * of_fit[cold].mean()  # correlations matter


def test_terms_that_were_not_needed_leave_the_others_their_own_rows(identified):
    folder, result = identified
    cell, posterior = cell_with_posterior(folder)
    bend = next(k.source for k in cell.known if isinstance(k.source, ThermalBend))
    labels = [t.label for t in result.model.parameters if t.source == "thermal_bend"]
    fit_of = {
        t.label: (p, s)
        for t, p, s in zip(result.model.parameters, result.selected.fit.p, result.selected.fit.sigma, strict=True)
        if t.source == "thermal_bend"
    }
    written = [" ".join(words) for words in zip(bend.link, bend.plane, bend.node_name, strict=True)]
    rows = [i for i, p in enumerate(posterior.parameters) if p.table == "thermal_bend"]
    assert 0 < len(written) < len(labels)
    for i in rows:
        value, sigma = fit_of[written[posterior.parameters[i].index[0]]]
        assert posterior.value[i] == pytest.approx(value, rel=1e-8)
        assert posterior.sigma[i] == pytest.approx(sigma, rel=1e-7)


def test_robot_file_is_renamed_with_its_posterior_beside_it(copied):
    (copied / "mine.toml").rename(copied / "other.toml")
    cell = load_cell(str(copied / "other.toml"))
    assert cell.posterior is not None
    assert not [f for f in cell.input_findings if f.code.startswith("posterior")]


def test_another_comment_or_line_end_keeps_the_posterior(copied):
    robot, file = copied / "mine.toml", copied / f"mine{POSTERIOR}"
    robot.write_text("# of the left cell\n" + robot.read_text())
    file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    assert load_cell(str(robot)).posterior is not None


def test_without_its_posterior_a_robot_file_says_that_the_band_is_too_wide(copied):
    (copied / f"mine{POSTERIOR}").unlink()
    cell = load_cell(str(copied / "mine.toml"))
    assert cell.posterior is None
    assert any(f.code == "posterior.missing" and "too wide" in f.message for f in cell.input_findings)


def test_a_robot_file_with_sigmas_that_names_no_posterior_says_so(copied):
    file = copied / "mine.toml"
    lines = [line for line in file.read_text().splitlines(keepends=True) if not line.startswith("posterior")]
    file.write_text("".join(lines))
    cell = load_cell(str(file))
    assert cell.posterior is None
    (message,) = [f.message for f in cell.input_findings if f.code.startswith("posterior")]
    assert "identified.posterior: no file is named" in message


def test_a_robot_file_that_was_never_identified_needs_no_posterior():
    cell = load_cell("m710ic50")
    assert cell.posterior is None
    assert not [f for f in cell.input_findings if f.code.startswith("posterior")]


def test_overridden_values_have_no_posterior(copied):
    cell = load_cell(str(copied / "mine.toml"), ["sources.joint_zeros.offset_mdeg=[0, 0, 0, 0, 0, 0]"])
    assert cell.posterior is None
    assert any(f.code == "posterior.overridden" for f in cell.input_findings)


def test_a_posterior_of_another_run_is_refused(copied):
    file = copied / f"mine{POSTERIOR}"
    file.write_text(file.read_text().replace("0", "1", 1))
    with pytest.raises(InputError, match=r"sha256 begins with .* another identification"):
        load_cell(str(copied / "mine.toml"))


def test_a_value_changed_by_hand_refuses_the_posterior(copied):
    robot = copied / "mine.toml"
    text = robot.read_text()
    first = tomllib.loads(text)["sources"]["joint_zeros"]["offset_mdeg"][1]
    robot.write_text(text.replace(f"{first:.9g}", "12.5", 1))
    with pytest.raises(InputError, match=r"joint_zeros.offset_mdeg\[2\].* robot file has 12.5"):
        load_cell(str(robot))


def test_a_source_that_this_posterior_does_not_know_counts_by_its_sigmas(copied):
    """What an earlier identification left in the file, and the last one did not fit."""

    def forget(record):
        kept = [i for i, p in enumerate(record["parameters"]) if not p["name"].startswith("thermal_growth")]
        rows = record["correlation"]
        record["correlation"] = [[rows[i][j] for j in kept if j <= i] for i in kept]
        record["parameters"] = [record["parameters"][i] for i in kept]

    names = [q.name for q in quantities_of_cell(load_cell(str(copied / "mine.toml"))).quantities]
    assert not any("thermal_growth" in name for name in names)
    damage(copied, forget)
    names = [q.name for q in quantities_of_cell(load_cell(str(copied / "mine.toml"))).quantities]
    assert any("thermal_growth" in name for name in names)
    assert not any("joint_zeros" in name for name in names)


def twice(record):
    record["parameters"][1] = record["parameters"][0]


def unknown(record):
    record["parameters"][0]["name"] = "joint_zeros.offset_mdeg[9]"


def not_positive(record):
    rows = record["correlation"]
    rows[1][0], rows[2][0], rows[2][1] = 0.9, 0.9, -0.9


def above_one(record):
    record["correlation"][1][0] = 1.2


def not_a_number(record):
    record["correlation"][1][0] = float("nan")


def short(record):
    record["correlation"][3].pop()


def few(record):
    record["correlation"].pop()


def diagonal(record):
    record["correlation"][2][2] = 0.5


def negative(record):
    record["parameters"][0]["sigma"] = -1.0


def no_list(record):
    record["parameters"] = 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (twice, "stands there twice"),
        (unknown, r"offset_mdeg\[9\] is not in the robot file"),
        (not_positive, "not positive"),
        (above_one, "1.2, must be -1 to 1"),
        (not_a_number, "must be -1 to 1"),
        (short, "row 4 has 3 numbers, must be 4"),
        (few, "rows of"),
        (diagonal, "with itself must be 1"),
        (negative, "must be a number from 0 up"),
        (no_list, "no posterior of an identification"),
    ],
)
def test_what_is_no_covariance_of_this_robot_is_refused_in_a_line(copied, change, message):
    damage(copied, change)
    with pytest.raises(InputError, match=message) as refusal:
        load_cell(str(copied / "mine.toml"))
    assert len(str(refusal.value).replace(str(copied), "")) <= 300
    assert POSTERIOR in str(refusal.value)


def test_the_file_keeps_a_covariance_to_its_digits():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(5, 5))
    parameters = tuple(KnownParameter("joint_zeros", "offset", (i,), "offset_mdeg", 1e-3) for i in range(5))
    covariance = root @ root.T * 1e-12
    text = posterior_text(ParameterPosterior(parameters, np.zeros(5), covariance), "arm")
    record = json.loads(text)
    matrix = np.zeros((5, 5))
    for i, row in enumerate(record["correlation"]):
        matrix[i, : i + 1] = row
    matrix += np.tril(matrix, -1).T
    sigma = np.array([p["sigma"] for p in record["parameters"]]) * 1e-3
    assert_allclose(matrix * np.outer(sigma, sigma), covariance, rtol=1e-5, atol=1e-19)


def test_a_network_has_no_law_and_takes_the_other_rows(identified):
    """A posterior of a warm-up with a log knows how nodes warm; the robot file's network is of the same robot."""
    folder, _ = identified
    cell, _ = cell_with_posterior(folder)
    record = json.loads((folder / f"mine{POSTERIOR}").read_text())
    others = len(record["parameters"])
    record["parameters"].insert(1, {"name": "thermal.node.rise_K[1]", "value": 11, "sigma": 0.5})
    for row in record["correlation"][1:]:
        row.insert(1, 0.0)
    record["correlation"].insert(1, [0.1, 1])
    content, law = json.dumps(record).encode(), np.array([11.0])
    of_nodes = read_posterior(content, known_numbers(cell.known, law, law), "here")
    of_network = read_posterior(content, known_numbers(cell.known), "here")
    rest = [i for i in range(others + 1) if i != 1]
    assert of_nodes.parameters[1].name == "thermal.node.rise_K[1]"
    assert of_network.parameters == tuple(of_nodes.parameters[i] for i in rest)
    assert_allclose(of_network.covariance, of_nodes.covariance[np.ix_(rest, rest)])


def test_rows_of_how_nodes_warm_count_where_the_heat_model_has_nodes(copied):
    file, name = str(copied / "mine.toml"), "thermal.node.rise_K[2]"
    law = load_cell(file).heat.law
    assert law is not None

    def with_law(record):
        record["parameters"].append({"name": name, "value": float(law.reference_rise[1]), "sigma": 0.5})
        record["correlation"].append([0] * len(record["correlation"]) + [1])

    damage(copied, with_law)
    _, posterior = cell_with_posterior(copied)
    assert posterior.parameters[-1].name == name
    assert posterior.value[-1] == law.reference_rise[1]
