"""LeafSystems for tracking: agents, sight, assignment, pursuit, evasion."""

from .adversarial_evaders import AdversarialEvaders
from .agent_team import AgentTeam, AgentTeam_, DifferentialDriveTeam, DifferentialDriveTeam_
from .assignment import Assignment
from .best_response_evaders import BestResponseEvaders
from .certified_pursuit import CertifiedPursuit
from .collision_avoidance import CollisionAvoidance, CollisionStop
from .guarantee_assignment import GuaranteeAssignment
from .guarantee_pursuit import GuaranteePursuit, TeamGuaranteePursuit
from .guaranteed_time import GuaranteedTime, StandingCertificate
from .heading_controller import HeadingController, HeadingController_, TurnFirstController
from .line_of_sight import LineOfSight, SightLossMonitor
from .lookahead_pursuit import LookaheadPursuit
from .modified_field import ModifiedField
from .optimal_evaders import OptimalEvaders
from .pursuit_field_controller import PursuitFieldController
from .scripted_evaders import RandomWalkEvaders, WaypointEvaders
from .velocity_selector import VelocitySelector

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
