"""LeafSystems of the tracking story: agents, sight, assignment, pursuit, evasion."""

from .adversarial_evaders import AdversarialEvaders
from .agent_team import AgentTeam, AgentTeam_
from .assignment import Assignment
from .best_response_evaders import BestResponseEvaders
from .certified_pursuit import CertifiedPursuit
from .collision_avoidance import CollisionAvoidance
from .collision_stop import CollisionStop
from .differential_drive_team import DifferentialDriveTeam, DifferentialDriveTeam_
from .guarantee_assignment import GuaranteeAssignment
from .guarantee_pursuit import GuaranteePursuit
from .guaranteed_time import GuaranteedTime
from .heading_controller import HeadingController, HeadingController_
from .line_of_sight import LineOfSight
from .lookahead_pursuit import LookaheadPursuit
from .modified_field import ModifiedField
from .optimal_evaders import OptimalEvaders
from .pursuit_field_controller import PursuitFieldController
from .random_walk_evaders import RandomWalkEvaders
from .sight_loss_monitor import SightLossMonitor
from .standing_certificate import StandingCertificate
from .team_guarantee_pursuit import TeamGuaranteePursuit
from .turn_first_controller import TurnFirstController
from .velocity_selector import VelocitySelector
from .waypoint_evaders import WaypointEvaders

__all__ = [
    "AdversarialEvaders",
    "AgentTeam",
    "AgentTeam_",
    "Assignment",
    "BestResponseEvaders",
    "CertifiedPursuit",
    "CollisionAvoidance",
    "CollisionStop",
    "DifferentialDriveTeam",
    "DifferentialDriveTeam_",
    "GuaranteeAssignment",
    "GuaranteePursuit",
    "GuaranteedTime",
    "HeadingController",
    "HeadingController_",
    "LineOfSight",
    "LookaheadPursuit",
    "ModifiedField",
    "OptimalEvaders",
    "PursuitFieldController",
    "RandomWalkEvaders",
    "SightLossMonitor",
    "StandingCertificate",
    "TeamGuaranteePursuit",
    "TurnFirstController",
    "VelocitySelector",
    "WaypointEvaders",
]
