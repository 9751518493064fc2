import pytest
from hypothesis import settings
from shipped import path_file

import compgen.cli.blas_threads  # noqa: F401  one thread a matrix product, as under the command; before numpy
from compgen.pipelines.job import Job
from compgen.pipelines.path_file import load_job

settings.register_profile("same every time", derandomize=True, deadline=None)  # a busy machine is no fault
settings.load_profile("same every time")


@pytest.fixture(scope="session")
def job() -> Job:
    """The study's circle on the study's robot."""
    return load_job(path_file("circle_1300"))


@pytest.fixture(scope="session")
def robot(job):
    return job.robot
