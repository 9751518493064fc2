"""Pages of compgen's own programs: from the columns the same bytes as statement by statement from the text."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compgen import fanuc as ls
from compgen.core.exceptions import ImpossibleError
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.canonical.writer import APPROACH_PERCENT
from compgen.fanuc.paging.join_check import check_join, interpret_pages
from compgen.fanuc.paging.split import split_canonical, split_program
from compgen.pipelines.planned import delivery
from compgen.program.pages import JoinError, excerpt
from compgen.program.program import Program
from compgen.program.speeds import writable_speed
from compgen.robot.inverse_kinematics import ALL_POSTURES
from compgen.robot.robot import Capacity

FIELDS = ("name", "data", "load", "motions", "size", "notes")


def program(count, seed=1, stops=0.2, decimals=3, remarks=("one", "two")):
    """Positions on a walk, with speeds in all units and a stop now and then."""
    rng = np.random.default_rng(seed)
    fine = rng.random(count) < stops
    fine[[0, -1]] = True
    return Program(
        name="OF_ITS_OWN",
        comment="a walk",
        date="26-01-01",
        remarks=remarks,
        uframe=int(rng.integers(0, 10)),
        utool=int(rng.integers(0, 31)),
        position=np.cumsum(rng.normal(size=(count, 3)), axis=0) * MM + [1.2, 0, 0.2],
        rotation=from_wpr(*(rng.uniform(-179, 179, size=(3, count)) * [[1], [0.4], [1]] * DEG)),
        posture=ALL_POSTURES[seed % 8],
        turns=rng.integers(-1, 2, size=(count, 3)),
        speed=np.array([writable_speed(v) for v in 10 ** rng.uniform(-3, 0, count - 1)]),
        fine=fine,
        via=np.zeros(count, dtype=bool),
        decimals=decimals,
    )


@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 250),
    st.integers(0, 10**6),
    st.sampled_from([0.02, 0.2, 0.9]),
    st.integers(3, 6),
    st.tuples(st.integers(6, 80), st.integers(2, 80), st.sampled_from([1e6, 2e4, 9e3, 5e3])),
    st.sampled_from([8, 12, 32]),
)
def test_columns_give_the_bytes_that_statements_give(count, seed, stops, decimals, limits, name_length):
    whole = replace(program(count, seed, stops, decimals), payload=(None, 1, 10)[seed % 3])
    capacity = Capacity(limits[0], limits[1], limits[2], name_length)

    def heading(k, pages, first):
        return (f"page {k + 1} of {pages}", "x" * (first % 20), f"from {max(first - 1, 0)}")

    def headings(first):
        return [heading(k, len(first), n + 1 if n else 0) for k, n in enumerate(first)]

    text = ls.loads(ls.compose(replace(whole, remarks=())))
    main = ("by", "us")
    try:
        wanted = split_program(
            text,
            capacity,
            heading=heading,
            renumber=True,
            joint_entry=APPROACH_PERCENT,
            head_lines=3,
            main_heading=main,
        )
    except ImpossibleError:
        with pytest.raises(ImpossibleError, match=r"more than a page holds"):
            split_canonical(whole, capacity, headings, head_lines=3, main_heading=main)
        return
    paged = split_canonical(whole, capacity, headings, head_lines=3, main_heading=main)
    assert paged.main == wanted.main
    for page, other in zip(paged.pages, wanted.pages, strict=True):
        for field in FIELDS:
            assert getattr(page, field) == getattr(other, field), field


def test_each_page_says_its_payload_and_its_acc():
    whole = replace(program(60, stops=0.5), payload=3, acc=40)
    paged = split_canonical(whole, Capacity(30, 30, 1e6, 32), lambda first: [("a page",)] * len(first), 2, ("by us",))
    assert len(paged.pages) > 2
    for page in paged.pages:
        read = ls.interpret(page.data)
        assert (read.payload, read.acc) == (3, 40)
        assert ls.compose(read) == page.data
        assert page.size.lines == page.data[page.data.index(b"/MN") : page.data.index(b"/POS")].count(b" ;\r\n")
        assert page.size.lines <= 30
    read, _ = interpret_pages(paged.main, {p.name: p.data for p in paged.pages})
    assert check_join(ls.loads(ls.compose(whole)), paged.main, {p.name: p.data for p in paged.pages}) == 60
    delivery.require_equal(read, whole)
    for other in ({"payload": 4}, {"payload": None}, {"acc": 39}, {"acc": None}):
        with pytest.raises(JoinError, match="payload or ACC"):
            delivery.require_equal(replace(read, **other), whole)
    pages = {p.name: p.data for p in paged.pages}
    last = paged.pages[-1].name
    for old, new, field in ((b"PAYLOAD[3]", b"PAYLOAD[4]", "payload"), (b" ACC40", b"", "acc")):
        with pytest.raises(JoinError, match=field):
            interpret_pages(paged.main, {**pages, last: pages[last].replace(old, new)})


def test_an_excerpt_holds_its_ends():
    whole = program(9)
    part = excerpt(whole, 2, 5)
    assert part.position.tolist() == whole.position[2:6].tolist()
    assert part.speed.tolist() == whole.speed[2:5].tolist()
    assert len(part.fine) == 4


@pytest.mark.parametrize(
    "change",
    [
        lambda p: replace(p, position=p.position + np.eye(len(p.position), 3, -20) * MM),
        lambda p: replace(p, rotation=p.rotation[::-1]),
        lambda p: replace(p, turns=p.turns[::-1]),
        lambda p: replace(p, speed=np.append(p.speed[:-1], 2 * p.speed[-1])),
        lambda p: replace(p, fine=~p.fine),
        lambda p: replace(p, utool=p.utool + 1),
        lambda p: excerpt(p, 0, len(p.position) - 2),
    ],
)
def test_what_was_read_must_be_what_was_meant(change):
    """Compared in blocks that end anywhere."""
    whole = program(40)
    read = ls.interpret(ls.compose(whole))
    for rows in (7, 40, 1000):
        delivery.require_equal(read, whole, rows)
        with pytest.raises(JoinError):
            delivery.require_equal(change(read), whole, rows)
        with pytest.raises(JoinError, match="length"):
            delivery.require_equal(read, excerpt(whole, 0, 38), rows)
