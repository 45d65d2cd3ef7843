"""One policy and its compiled programs for all tests of the viewer."""

import pytest
from support.viewer_rig import make_live, make_watched


@pytest.fixture(scope="session")
def watched(tmp_path_factory):
    return make_watched(tmp_path_factory.mktemp("viewer"))


@pytest.fixture(scope="session")
def live(watched):
    return make_live(watched)
