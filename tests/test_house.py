"""Sizes, and what docstrings state: a reader finds each thing small and explained."""

import ast

import pytest
from support import house

PACKAGES = tuple(house.PACKAGES)
LINES, BODY, PARAMETERS = 300, 60, 6
ENTRIES = {"fingers_mjx": 14, "sysid": 14, "envs": 24}
STATED = {"rewards": 0.9, "envs": 0.6, "sysid": 0.6}
"""Share of public numeric functions that state equation, shapes, units and source."""


@pytest.mark.parametrize("package", PACKAGES)
def test_files_are_short(package):
    sizes = {f: len(f.read_text("utf-8").splitlines()) for f in house.files(package)}
    assert sizes
    assert [str(f) for f, size in sizes.items() if size > LINES] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_bodies_are_short(package):
    found = [f for f in house.functions(package) if house.body_lines(f.node) > BODY]
    assert [f.where for f in found] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_public_functions_take_few_parameters(package):
    public = [f for f in house.functions(package) if f.public]
    found = [f for f in public if house.parameters(f.node) > PARAMETERS]
    assert [f.where for f in found] == []


@pytest.mark.parametrize(("folder", "most"), ENTRIES.items())
def test_a_folder_is_seen_at_a_glance(folder, most):
    assert len(house.entries(house.ROOT / folder)) <= most


def test_the_shim_is_small():
    assert house.lines("fingers_deploy") <= 1900


@pytest.mark.parametrize(("package", "share"), STATED.items())
def test_numeric_functions_state_equation_shapes_units_and_source(package, share):
    lacking, number = house.undocumented(package)
    assert number > 30
    assert 1.0 - len(lacking) / number >= share, lacking


FUNCTION = '''
def kinetic(mass_kg: Float[Array, ""], vel_w: Float[Array, "3"]) -> Float[Array, ""]:
    """Kinetic energy, E = ½ m |v|² [J] of a mass [kg] at a velocity [m/s].

    Source:
        Any textbook of mechanics.
    """
    return 0.5 * mass_kg * (vel_w @ vel_w)
'''


@pytest.mark.parametrize(
    ("old", "new", "lost"),
    [
        ("E = ½ m |v|²", "", "equation"),
        ('Float[Array, "3"]', "Array", "shapes"),
        (" [J] of a mass [kg] at a velocity [m/s]", "", "units"),
        ("Source:", "See", "source"),
    ],
)
def test_what_a_docstring_lacks_is_seen(old, new, lost):
    """Negative control: of a function that states all, one thing is taken away."""
    whole, less = (ast.parse(t).body[0] for t in (FUNCTION, FUNCTION.replace(old, new)))
    assert house.states(whole) == {"equation", "shapes", "units", "source"}
    assert house.states(less) == house.states(whole) - {lost}
