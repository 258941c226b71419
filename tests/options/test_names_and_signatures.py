"""Options as people meet them: names nearly right, keywords in signatures, short reprs."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import femprep as fp
from femprep.options import FibreOptions, StageOptions, choose


@pytest.mark.parametrize(
    ("kind", "name", "meant"),
    [
        ("SurfaceOptions", "vertice", "did you mean 'vertices'?"),
        ("VolumeOptions", "edgelength", "did you mean 'edge_length'?"),
        ("Options", "anatomie", "did you mean 'anatomy'?"),
        # A group's option given to the run, or to the wrong group.
        ("Options", "edge_length", "did you mean 'volume.edge_length' or 'sweep.edge_length'?"),
        ("Options", "endo_angel", "did you mean 'fibres.endo_angle'"),
    ],
)
def test_an_unknown_option_names_the_nearest(kind: str, name: str, meant: str) -> None:
    with pytest.raises(fp.OptionError) as caught:
        choose(getattr(fp, kind), None, {name: 1})
    assert f"unknown option {name!r}; {meant[:-1]}" in str(caught.value)
    assert str(caught.value).endswith("?")


def test_a_key_of_a_group_is_sought_in_that_group_first() -> None:
    with pytest.raises(
        fp.OptionError, match=r"unknown option 'sweep.edge_lenght'; did you mean 'sweep.edge_length'\?$"
    ):
        choose(fp.Options, None, {"sweep": {"edge_lenght": 1.0}})
    with pytest.raises(fp.OptionError, match=r"'surface.edge_length'; did you mean 'volume.edge_length' or"):
        choose(fp.Options, None, {"surface": {"edge_length": 1.0}})


def test_nothing_is_guessed_where_nothing_is_near() -> None:
    with pytest.raises(fp.OptionError, match=r"unknown option 'colour'$"):
        choose(FibreOptions, None, {"colour": 1})


def test_no_public_function_hides_its_options() -> None:
    for name in fp.__all__:
        found = getattr(fp, name)
        kinds = (
            [each.kind for each in inspect.signature(found).parameters.values()] if inspect.isfunction(found) else []
        )
        assert inspect.Parameter.VAR_KEYWORD not in kinds, name
    shown = inspect.signature(fp.fit_surface).parameters
    assert shown["vertices"].default == 1500
    assert shown["vertices"].kind is inspect.Parameter.KEYWORD_ONLY
    assert {"minimum_thickness", "base_offset"} <= set(inspect.signature(fp.build_wall).parameters)
    assert "policy" in inspect.signature(fp.Segmentation.object).parameters


def test_all_option_classes_are_public() -> None:
    own = {kind.__name__ for kind in StageOptions.__subclasses__() if kind.__module__.startswith("femprep.options")}
    own = (own - {"LeastThickness"}) | {"WallOptions", "SweepOptions"}
    assert own <= set(fp.__all__)
    assert "Grid" in fp.__all__


def test_options_show_what_was_given() -> None:
    assert repr(fp.Options()) == "Options()"
    assert repr(fp.Options(volume={"edge_length": 2.0})) == "Options(volume=VolumeOptions(edge_length=2.0))"


@pytest.mark.parametrize("options", [{"minimum_dihedral": 5}, fp.SurfaceOptions(), 0, "abc"])
def test_options_of_another_kind_are_refused_in_one_line(options: object) -> None:
    with pytest.raises(fp.OptionError, match=r"^options are .*, expected CheckOptions\(\.\.\.\); or give each option"):
        choose(fp.CheckOptions, options, {})


def test_a_value_of_many_lines_is_quoted_in_one() -> None:
    with pytest.raises(fp.OptionError, match=r"option 'minimum_dihedral' is array.*\.\.\.: input should be") as refused:
        choose(fp.CheckOptions, None, {"minimum_dihedral": np.ones((9, 9))})
    assert "\n" not in str(refused.value)
