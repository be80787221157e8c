"""LeafSystems for tracking: agents, sight, assignment, pursuit, evasion."""

from .agent_team import AgentTeam, AgentTeam_, DifferentialDriveTeam, DifferentialDriveTeam_
from .assignment import Assignment, GuaranteeAssignment
from .best_response_evaders import BestResponseEvaders
from .certified_pursuit import CertifiedPursuit
from .collision_avoidance import CollisionAvoidance, CollisionStop
from .evaders import (
    AdversarialEvaders,
    OptimalEvaders,
    RandomWalkEvaders,
    VelocitySelector,
    WaypointEvaders,
)
from .guarantee_pursuit import GuaranteePursuit, TeamGuaranteePursuit
from .guaranteed_time import GuaranteedTime, StandingCertificate
from .heading_controller import HeadingController, HeadingController_, TurnFirstController
from .line_of_sight import LineOfSight, SightLossMonitor
from .pursuit_laws import LookaheadPursuit, ModifiedField, PursuitFieldController

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
