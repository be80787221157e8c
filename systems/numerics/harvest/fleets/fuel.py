"""Fuel of combines and of tractors with grain carts, by a model that is stated in full.

An engine whose rated power is P [kW], loaded by the part X of it, with its speed reduced by N
percent, burns (Grisso, Kocher and Vaughan 2004, Predicting tractor fuel consumption, Applied
Engineering in Agriculture 20(5); the form that ASABE EP496.3 and D497 took over)

    Q = (0.22 X + 0.096) (1 + 0.0045 X N - 0.00877 N) P      [l/h]

A combine in small grains needs, by ASAE D497.7, Table 2, 20 kW and 3.6 kWh for each tonne of what
is no grain; and any machine on wheels on firm soil, by its clause on motion resistance (1 / B_n +
0.04 with B_n = 55), 5.8% of its weight as a force along its way. Assumed here, and not taken from
there: as much straw as grain goes through the combine, four fifths of the power of an engine reach
the wheels, and engines of machines that stand turn at half their speed without a load.
"""

from dataclasses import dataclass

from ...errors import require, require_non_negative, require_positive

# Weight of a kilogram [N].
GRAVITY = 9.80665
# Of a combine's threshing, in small grains (D497.7, Table 2): [W], and [J/kg] of what is no grain.
THRESHING, PER_STRAW = 20e3, 3.6 * 3600.0
# Motion resistance over weight on firm soil (D497.7): 1 / B_n + 0.04, B_n = 55 [-].
RESISTANCE = 1.0 / 55.0 + 0.04
# Of an engine: fuel by load, fuel without load [l/(kW h)]; what a percent of speed saves [-].
BY_LOAD, WITHOUT_LOAD, BY_BOTH, BY_SPEED = 0.22, 0.096, 0.0045, 0.00877
# Speed that engines of standing machines are reduced by [%].
IDLING = 50.0


@dataclass(frozen=True, kw_only=True)
class FuelModel:
    """What the model assumes besides the figures of the machines.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # What goes through a combine besides grain, over the grain [-].
    straw_ratio: float = 1.0
    # Part of an engine's power that reaches the wheels [-].
    driveline: float = 0.8

    def __post_init__(self) -> None:
        require_non_negative("straw_ratio", self.straw_ratio)
        require(0 < self.driveline <= 1, "driveline", "lie above 0 and up to 1", self.driveline)


def fuel_rate(power: float, load: float, slowed: float = 0.0) -> float:
    """What an engine burns [l/s].

    Args:
        power: Its rated power [W].
        load: What is asked of it [W].
        slowed: By how much its speed is reduced [%].

    Raises:
        InvalidInput: A value is out of its range.
    """
    require_positive("power", power)
    require_non_negative("load", load)
    part = load / power
    speed = 1.0 + BY_BOTH * part * slowed - BY_SPEED * slowed
    return (BY_LOAD * part + WITHOUT_LOAD) * speed * power / 1e3 / 3600.0


def idling_rate(power: float) -> float:
    """What the engine of a machine burns that stands [l/s].

    Args:
        power: Its rated power [W].
    """
    return fuel_rate(power, 0.0, IDLING)


def driving_energy(mass: float, way: float, model: FuelModel) -> float:
    """What an engine gives to move a mass over firm soil [J].

    Args:
        mass: [kg].
        way: [m].
        model: What is assumed.
    """
    return RESISTANCE * GRAVITY * mass * way / model.driveline


def driving_fuel(power: float, energy: float, time: float) -> float:
    """What an engine burns at full speed that gives an energy in a time [l].

    The law is linear in the load, so that only the sum of the energy counts.

    Args:
        power: Its rated power [W].
        energy: [J].
        time: That it runs [s].
    """
    return (BY_LOAD * energy + WITHOUT_LOAD * power * time) / 3.6e6


def threshing_energy(grain: float, time: float, model: FuelModel) -> float:
    """What a combine's engine gives to thresh [J].

    Args:
        grain: That goes through it [kg].
        time: That it works [s].
        model: What is assumed.
    """
    return THRESHING * time + PER_STRAW * model.straw_ratio * grain
