from .diagrams.social.make_social_search import AddSocialSearch as AddSocialSearch
from .diagrams.social.make_social_search import MakeSocialSearch as MakeSocialSearch
from .diagrams.social.report import draw_connectivity as draw_connectivity
from .diagrams.social.report import draw_detections as draw_detections
from .diagrams.social.report import draw_search as draw_search
from .diagrams.social.report import summarise_search as summarise_search
from .diagrams.social.report import write_search_report as write_search_report
from .diagrams.social.run import SocialRun as SocialRun
from .diagrams.social.run import run_social_search as run_social_search
from .diagrams.social.scenario import AgentCamera as AgentCamera
from .diagrams.social.scenario import Crowd as Crowd
from .diagrams.social.scenario import MazeSource as MazeSource
from .diagrams.social.scenario import SearchingPursuer as SearchingPursuer
from .diagrams.social.scenario import SearchPolicy as SearchPolicy
from .diagrams.social.scenario import SocialScenario as SocialScenario
from .diagrams.social.scenario import SoughtEvader as SoughtEvader
from .diagrams.social.social_game import SocialGame as SocialGame
from .diagrams.social.social_game import set_up_social_game as set_up_social_game
from .hardware_io.social.accounts import load_directory as load_directory
from .hardware_io.social.accounts import make_directory as make_directory
from .hardware_io.social.accounts import save_directory as save_directory
from .systems.numerics.social.landmarks.forward_camera import ForwardCamera as ForwardCamera
from .systems.numerics.social.landmarks.forward_camera import project_forward as project_forward
from .systems.numerics.social.landmarks.maze import Landmark as Landmark
from .systems.numerics.social.landmarks.maze import MarkerBlock as MarkerBlock
from .systems.numerics.social.landmarks.maze import Maze as Maze
from .systems.numerics.social.landmarks.thesis_maze import thesis_maze as thesis_maze
from .systems.numerics.social.localisation.location import Location as Location
from .systems.numerics.social.localisation.location import locate_evader as locate_evader
from .systems.numerics.social.localisation.perspective import edge_bearing as edge_bearing
from .systems.numerics.social.localisation.perspective import edge_distance as edge_distance
from .systems.numerics.social.localisation.perspective import square_by_edges as square_by_edges
from .systems.numerics.social.network.acceptance import MemoryNetwork as MemoryNetwork
from .systems.numerics.social.network.acceptance import (
    MutualFriendsAcceptance as MutualFriendsAcceptance,
)
from .systems.numerics.social.network.acceptance import OwnAcceptance as OwnAcceptance
from .systems.numerics.social.network.acceptance import Temperaments as Temperaments
from .systems.numerics.social.network.acceptance import thesis_temperaments as thesis_temperaments
from .systems.numerics.social.network.evolution import EvolutionLimits as EvolutionLimits
from .systems.numerics.social.network.evolution import evolve as evolve
from .systems.numerics.social.network.evolution import strangers as strangers
from .systems.numerics.social.network.friendship_chain import FriendshipChain as FriendshipChain
from .systems.numerics.social.network.friendship_chain import (
    connected_fraction as connected_fraction,
)
from .systems.numerics.social.network.friendship_chain import friendship_chain as friendship_chain
from .systems.numerics.social.network.interface import SocialNetwork as SocialNetwork
from .systems.numerics.social.recognition.recognition import LandmarkDetection as LandmarkDetection
from .systems.numerics.social.recognition.recognition import Recognition as Recognition
from .systems.numerics.social.recognition.recognition import recognise as recognise
from .systems.numerics.social.recognition.references import References as References
from .systems.numerics.social.recognition.references import maze_references as maze_references
from .systems.numerics.social.routes.shortest_route import Route as Route
from .systems.numerics.social.routes.shortest_route import RouteGraph as RouteGraph
from .systems.numerics.social.routes.shortest_route import build_route_graph as build_route_graph
from .systems.numerics.social.routes.shortest_route import shortest_route as shortest_route
from .systems.social import AgentInterest as AgentInterest
from .systems.social import CrowdGuard as CrowdGuard
from .systems.social import EvaderLocator as EvaderLocator
from .systems.social import ForwardCameras as ForwardCameras
from .systems.social import ImageScanner as ImageScanner
from .systems.social import InfraredSensors as InfraredSensors
from .systems.social import NetworkEvolution as NetworkEvolution
from .systems.social import PicturePoster as PicturePoster
from .systems.social import RoutePursuer as RoutePursuer
from .systems.social import Wanderers as Wanderers
from .systems.social.maze_renderer import MazeRenderer as MazeRenderer
