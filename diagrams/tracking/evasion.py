"""The evaders' policies, each evader with its own."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import MatrixGain

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import InvalidInput, require_type
from ...systems.numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ...systems.tracking.best_response_evaders import BestResponseEvaders
from ...systems.tracking.evaders import (
    AdversarialEvaders,
    OptimalEvaders,
    RandomWalkEvaders,
    VelocitySelector,
    WaypointEvaders,
)
from .controls import MeshcatVelocity
from .game import TrackingGame
from .scenario import CERTIFIED, GUARANTEE, OPTIMAL_DISTANCE, OPTIMAL_POLICIES
from .solved_game import solved_game, solved_game_of_two


def AddEvasion(
    builder: DiagramBuilder,
    game: TrackingGame,
    senses: dict[str, OutputPort],
    meshcat: Meshcat | None,
) -> OutputPort:
    """Add what moves the evaders; return their desired velocities, size 2 Ne [m/s].

    Args:
        builder: Of the diagram.
        game: Whose evaders.
        senses: Outputs that a policy may look at, by the name of its input port.
        meshcat: The page on which you drive the evader whose policy is "you".

    Raises:
        InvalidInput: An evader is yours and there is no page.
    """
    require_type("game", game, TrackingGame)
    choices = game.scenario.evaders.policy_of_each
    policies = sorted(set(choices))
    outputs = []
    for policy in policies:
        output = _add_policy(builder, policy, game, meshcat, shared="responsible" in senses)
        system: System = output.get_system()  # type: ignore[assignment]  # stubs say object
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            if port.get_name() in senses:
                builder.Connect(senses[port.get_name()], port)
        outputs.append(output)
    if len(outputs) == 1:
        return outputs[0]
    numbers = [policies.index(choice) for choice in choices]
    selector = VelocitySelector(numbers, sources=len(outputs))
    selector = add_named(builder, "evader_policies", selector)
    for k, output in enumerate(outputs):
        builder.Connect(output, selector.GetInputPort(f"source_{k}"))
    return selector.GetOutputPort("velocity")


def _add_policy(
    builder: DiagramBuilder,
    policy: str,
    game: TrackingGame,
    meshcat: Meshcat | None,
    *,
    shared: bool,
) -> OutputPort:
    """Add one policy for all evaders, which pursuers may share out among themselves."""
    scenario, evaders = game.scenario, game.scenario.evaders
    if policy == "you":
        return _add_driver(builder, game, meshcat)
    system: System
    if policy == "waypoints":
        system = WaypointEvaders(
            evaders.waypoints, top_speed=evaders.top_speed, period=scenario.period
        )
    elif policy == "random_walk":
        system = RandomWalkEvaders(
            evaders.size,
            top_speed=evaders.top_speed,
            turn_period=evaders.turn_period,
            seed=scenario.seed,
        )
    elif policy == "best_response":
        system = BestResponseEvaders(
            game.world,
            game.pursuer_regions,
            game.evader_regions,
            pursuers=scenario.pursuers.size,
            evaders=evaders.size,
            pursuer_speed=scenario.pursuers.top_speed,
            evader_speed=evaders.top_speed,
            pursuit=scenario.pursuers.field,
            risk_vectors=scenario.pursuers.risk_vectors,
            assignment=scenario.pursuers.assignment,
            hold=scenario.pursuers.switch,
            extra=scenario.pursuers.extra,
            risk_functions=scenario.pursuers.risk_functions,
            radius=evaders.radius,
            table=_game_of_pursuers(game),
            double=solved_game_of_two(game) if shared else None,
        )
    elif policy in OPTIMAL_POLICIES:
        system = OptimalEvaders(
            solved_game(game),
            game.world,
            game.evader_regions,
            pursuers=scenario.pursuers.size,
            evaders=evaders.size,
            with_distance=policy == OPTIMAL_DISTANCE,
            radius=evaders.radius,
        )
    else:
        system = AdversarialEvaders(
            game.world,
            pursuers=scenario.pursuers.size,
            evaders=evaders.size,
            top_speed=evaders.top_speed,
            speed_ratio=scenario.speed_ratio,
            radius=evaders.radius,
        )
    return add_named(builder, f"{policy}_evaders", system).GetOutputPort("velocity")


def _game_of_pursuers(game: TrackingGame) -> GuaranteedTimes | None:
    """The visibility game that the pursuers play by; None where they do not."""
    bound = {GUARANTEE: "middle", CERTIFIED: "lower"}.get(game.scenario.pursuers.field)
    return None if bound is None else solved_game(game, bound)


def _add_driver(builder: DiagramBuilder, game: TrackingGame, meshcat: Meshcat | None) -> OutputPort:
    """Add the sliders and keys with which you drive your evader, among zeros for the others."""
    scenario, evaders = game.scenario, game.scenario.evaders
    if meshcat is None:
        raise InvalidInput("`evaders.policies` must not be you without a page; got no Meshcat")
    driver = MeshcatVelocity(meshcat, evaders.top_speed, period=scenario.period)
    driver = add_named(builder, "your_velocity", driver)
    place = np.zeros((2 * evaders.size, 2))
    yours = 2 * evaders.policy_of_each.index("you")
    place[yours, 0] = place[yours + 1, 1] = 1.0
    spread = MatrixGain(D=place)  # type: ignore[arg-type]  # the stubs lag behind NumPy's
    add_named(builder, "your_evader", spread)
    builder.Connect(driver.GetOutputPort("velocity"), spread.get_input_port())
    return spread.get_output_port()
