from pathlib import Path

import pytest
from hypothesis import settings

import compgen.cli.alone  # noqa: F401  one thread a matrix product, as under the command; before numpy
from compgen.config import load_job
from compgen.job import Job

ROOT = Path(__file__).parents[1]

settings.register_profile("same every time", derandomize=True)
settings.load_profile("same every time")


def path_file(name: str) -> str:
    return str(ROOT / "paths" / f"{name}.toml")


def quiet(stage: str, share: float) -> None:
    """A progress callback that says nothing."""


@pytest.fixture(scope="session")
def job() -> Job:
    """The study's circle on the study's robot."""
    return load_job(path_file("circle_1300"))


@pytest.fixture(scope="session")
def robot(job):
    return job.robot
