from .diagrams.planning.methods import PlanningQuestion as PlanningQuestion
from .diagrams.planning.methods import chosen_methods as chosen_methods
from .diagrams.planning.report import as_table as as_table
from .diagrams.planning.report import write_planning_report as write_planning_report
from .diagrams.planning.sweep import DirectionSweep as DirectionSweep
from .diagrams.planning.sweep import sweep_ratios as sweep_ratios
from .diagrams.planning.verdict import PlanningVerdict as PlanningVerdict
from .diagrams.planning.verdict import Resimulation as Resimulation
from .diagrams.planning.verdict import ask_methods as ask_methods
from .diagrams.planning.verdict import contradictions as contradictions
from .diagrams.planning.verdict import resimulate as resimulate
from .systems.numerics.planning.car_paths import dubins_between as dubins_between
from .systems.numerics.planning.extremals.planner import plan_by_extremals as plan_by_extremals
from .systems.numerics.planning.extremals.primitives import plan_by_primitives as plan_by_primitives
from .systems.numerics.planning.goal import THESIS_TOLERANCE as THESIS_TOLERANCE
from .systems.numerics.planning.goal import Goal as Goal
from .systems.numerics.planning.lower_bound import lower_bound as lower_bound
from .systems.numerics.planning.minimum_time.planner import plan_by_casadi as plan_by_casadi
from .systems.numerics.planning.path_tracking import PathTracker as PathTracker
from .systems.numerics.planning.path_tracking import make_path_tracker as make_path_tracker
from .systems.numerics.planning.plan import Plan as Plan
from .systems.numerics.planning.plan import TrailerPath as TrailerPath
from .systems.numerics.planning.planners.from_table import (
    plan_by_value_function as plan_by_value_function,
)
from .systems.numerics.planning.planners.from_table import plan_from_table as plan_from_table
from .systems.numerics.planning.planners.polished import plan_polished as plan_polished
from .systems.numerics.planning.planners.thesis_scheme import plan_by_averaging as plan_by_averaging
from .systems.numerics.planning.trailer import Trailer as Trailer
from .systems.numerics.planning.trailer import trailer_rates as trailer_rates
from .systems.numerics.planning.value_function.files import (
    load_value_function as load_value_function,
)
from .systems.numerics.planning.value_function.files import (
    save_value_function as save_value_function,
)
from .systems.numerics.planning.value_function.grid import StateGrid as StateGrid
from .systems.numerics.planning.value_function.grid import grid_around as grid_around
from .systems.numerics.planning.value_function.policy import attained_times as attained_times
from .systems.numerics.planning.value_function.solve import (
    solve_value_function as solve_value_function,
)
from .systems.numerics.planning.value_function.value_function import ValueFunction as ValueFunction
from .systems.planning import PathFollower as PathFollower
from .systems.planning import TractorTrailer as TractorTrailer
from .systems.planning import TractorTrailer_ as TractorTrailer_
from .systems.planning import ValueFunctionFeedback as ValueFunctionFeedback
from .systems.planning import control_trajectory as control_trajectory
from .systems.planning import state_trajectory as state_trajectory
