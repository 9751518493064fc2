"""A short run of the campaign of users' files; tests/campaigns/user_files.py has the long one."""

import re

import naive_files as naive
import numpy as np
import pytest
import user_files
from drawn_urdf import drawn_urdf
from meshes import binary, grid_mesh


@pytest.mark.parametrize("seed", range(12))
def test_what_is_taken_of_a_users_file_is_what_it_says(seed):
    wrong = [words for words in user_files.tried(seed)["wrong"] if not user_files.is_open(words)]
    assert not wrong, wrong


def test_every_change_is_drawn(tmp_path):
    for kind, draw in user_files.KINDS.items():
        changes = {draw(np.random.default_rng([seed, 9]), tmp_path)[0] for seed in range(40)}
        assert "" in changes, kind
        assert len(changes) > 2, kind


def test_the_second_readers_bite():
    """They see a facet that faces down, a count that is too small, an axis that is turned, a touch that moved away."""
    top = grid_mesh(lambda x, y: 0 * x, n=5)
    assert naive.stl_top(naive.stl(binary(top)), 10.3, 20.1)[1] > 0
    assert naive.stl_top(naive.stl(binary(top[:, ::-1])), 10.3, 20.1)[1] < 0
    assert naive.stl_top(naive.stl(binary(np.concatenate([top, top - [0, 0, 0.01]]))), 10.3, 20.1)[0] == 0
    with pytest.raises(ValueError, match="count"):
        naive.stl(binary(top) + b"\0" * 50)
    with pytest.raises(ValueError, match="is not vertex"):
        naive.stl(b"solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 endloop endfacet endsolid")
    text, *_ = drawn_urdf(3)
    way, _ = naive.urdf(text)
    turned, _ = naive.urdf(re.sub(r'axis xyz="(\S+)', lambda m: f'axis xyz="{-float(m[1])}', text, count=1))
    assert np.abs(naive.urdf_pose(way, np.ones(6)) - naive.urdf_pose(turned, np.ones(6))).max() > 0.01
    for change in ("a mimic joint", "two arms", "a rail", "no tool0"):
        with pytest.raises(ValueError):
            naive.urdf(user_files.URDF[change](text))
    target = {"kind": "sphere", "place": [0.0, 0, 0], "diameter_mm": 20.0, "normal": None}
    row, probe = {"nx": "0", "ny": "0", "nz": "-1", "value_mm": "0.2"}, {"diameter_mm": 6.0}
    assert naive.gap(row, target, probe, np.array([0, 0, 12.8]), np.eye(4)) == pytest.approx(0)
    with pytest.raises(ValueError, match="away"):
        naive.gap({**row, "nz": "1"}, target, probe, np.array([0, 0, 12.8]), np.eye(4))
