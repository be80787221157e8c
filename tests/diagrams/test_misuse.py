"""What parts of diagrams say to things that they are not made for: one line, and no more."""

import pytest
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ZeroOrderHold

import sightfield.all as everything
from sightfield.diagrams.scenario_files import load_scenario
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import AddSmoothing, AddTracking
from sightfield.diagrams.tracking.scenario import Pursuers, TrackingScenario
from sightfield.diagrams.tracking.team_ports import AddTeam
from sightfield.systems.drake_parts import add_named
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.tracking import Assignment, CollisionAvoidance, LineOfSight

WORLD = make_world([[0, 0], [4, 0], [4, 4], [0, 4]])
TEAM = Pursuers(top_speed=1.0, count=1)
# Of each function what makes up for the arguments beside the builder and the one that is wrong.
MAKERS = {
    "MakeHarvest": (),
    "MakePictureTracking": (),
    "MakeSocialSearch": (),
    "MakeStandoff": (),
    "MakeStation": (),
    "MakeTracking": (),
    "run_harvest": (),
    "run_map_study": (),
    "run_picture_tracking": (),
    "run_social_search": (None,),
    "run_standoff": (1.0,),
    "run_study": ("folder",),
    "run_tracking": (),
    "set_up_game": (),
    "set_up_picture_game": (),
    "set_up_social_game": (),
    "prepare_harvest": (),
    "find_what_it_takes": (),
}
ADDERS = {
    "AddHarvest": (),
    "AddPictureTracking": (),
    "AddSocialSearch": (None,),
    "AddTracking": (),
}


def add_team(builder, name="pursuer", regions=(WORLD,), team=TEAM):
    return AddTeam(builder, name, team, [[1.0, 1.0, 0.0]], regions, 0.05)


@pytest.mark.parametrize("thing", ["thesis_3v4", None, {}], ids=["name", "None", "mapping"])
@pytest.mark.parametrize("name", [*MAKERS, *ADDERS])
def test_what_is_no_scenario_and_no_game_is_refused_by_its_type(name, thing):
    builder = (DiagramBuilder(),) if name in ADDERS else ()
    others = {**MAKERS, **ADDERS}[name]
    with pytest.raises(InvalidInput, match=r"must be of type .*; got ") as refused:
        getattr(everything, name)(*builder, thing, *others)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("regions", "message"),
    [
        (WORLD, "`regions` must be a list of worlds; got one World"),
        ([], "`regions` must have one world at least; got none"),
        ([None], r"`regions\[0\]` must be of type World; got NoneType"),
        (None, "`regions` must be of type Sequence; got NoneType"),
    ],
    ids=["one", "none", "None in it", "None"],
)
def test_a_team_needs_a_list_of_worlds(regions, message):
    with pytest.raises(InvalidInput, match=message):
        add_team(DiagramBuilder(), regions=regions)
    with pytest.raises(InvalidInput, match=message):
        CollisionAvoidance(regions, count=1, top_speed=1.0, period=0.05)


def test_a_team_is_no_number_of_robots():
    with pytest.raises(InvalidInput, match="`team` must be of type RobotTeam; got int: 1"):
        add_team(DiagramBuilder(), team=1)


@pytest.mark.parametrize("world", [None, [WORLD], "map.wkt"], ids=["None", "list", "file"])
@pytest.mark.parametrize("system", [LineOfSight, Assignment])
def test_a_system_needs_a_world(system, world):
    with pytest.raises(InvalidInput, match="`world` must be of type World; got "):
        system(world, pursuers=1, evaders=1)


def test_two_systems_of_one_name_are_refused_when_the_second_is_added():
    builder = DiagramBuilder()
    add_named(builder, "hold", ZeroOrderHold(0.1, 1))
    with pytest.raises(InvalidInput, match="`builder` must have no system hold yet; got one"):
        add_named(builder, "hold", ZeroOrderHold(0.1, 1))
    assert len(builder.Build().GetSystems()) == 1


def test_two_teams_and_two_games_in_one_diagram_need_names_of_their_own():
    builder = DiagramBuilder()
    team = add_team(builder)
    add_team(builder, "second")
    with pytest.raises(InvalidInput, match="must have no system pursuer_avoidance yet"):
        add_team(builder)
    AddSmoothing(builder, team.position, 0.4, 0.05)
    with pytest.raises(InvalidInput, match="must have no system smoothing yet"):
        AddSmoothing(builder, team.position, 0.4, 0.05)
    game = set_up_game(load_scenario(TrackingScenario, "corner_1v1"))
    builder = DiagramBuilder()
    AddTracking(builder, game)
    with pytest.raises(InvalidInput, match=r"must have no system .* yet"):
        AddTracking(builder, game)
