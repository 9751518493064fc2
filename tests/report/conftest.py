import pytest
from every_page import write_pages


@pytest.fixture(scope="session")
def every_page(tmp_path_factory):
    """The page of each command that writes one, by the command."""
    return write_pages(tmp_path_factory.mktemp("pages"))
