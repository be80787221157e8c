from .diagrams.tracking.certified_games import CertifiedGame as CertifiedGame
from .diagrams.tracking.certified_games import play_certified_games as play_certified_games
from .diagrams.tracking.corner_picture import draw_corner_game as draw_corner_game
from .diagrams.tracking.guarantee_picture import draw_guarantee as draw_guarantee
from .diagrams.tracking.solved_game import solved_game as solved_game
from .diagrams.tracking.solved_game import solved_game_of_two as solved_game_of_two
from .systems.numerics.tracking.corner_game import IN_STAR as IN_STAR
from .systems.numerics.tracking.corner_game import REGION_NAMES as REGION_NAMES
from .systems.numerics.tracking.corner_game import escape_time as escape_time
from .systems.numerics.tracking.corner_game import from_corner_frame as from_corner_frame
from .systems.numerics.tracking.corner_game import margins as margins
from .systems.numerics.tracking.corner_game import region as region
from .systems.numerics.tracking.corner_game import to_corner_frame as to_corner_frame
from .systems.numerics.tracking.corner_policies import FIELDS as FIELDS
from .systems.numerics.tracking.corner_policies import corner_field as corner_field
from .systems.numerics.tracking.corner_policies import evader_policy as evader_policy
from .systems.numerics.tracking.corner_policies import margin_field as margin_field
from .systems.numerics.tracking.corner_policies import pursuer_policy as pursuer_policy
from .systems.numerics.tracking.corner_policies import table_field as table_field
from .systems.numerics.tracking.corner_study.best_response import (
    solve_best_response as solve_best_response,
)
from .systems.numerics.tracking.corner_study.game_solution import (
    solve_corner_game as solve_corner_game,
)
from .systems.numerics.tracking.corner_study.moves import CornerGrid as CornerGrid
from .systems.numerics.tracking.corner_study.moves import CornerValues as CornerValues
from .systems.numerics.tracking.corner_study.play import play_out as play_out
from .systems.numerics.tracking.visibility_game.files import (
    load_guaranteed_times as load_guaranteed_times,
)
from .systems.numerics.tracking.visibility_game.files import (
    save_guaranteed_times as save_guaranteed_times,
)
from .systems.numerics.tracking.visibility_game.ground import WallPlaces as WallPlaces
from .systems.numerics.tracking.visibility_game.ground import wall_places as wall_places
from .systems.numerics.tracking.visibility_game.guaranteed_times import (
    GuaranteedTimes as GuaranteedTimes,
)
from .systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game as solve_visibility_game,
)
from .systems.numerics.tracking.visibility_game.two_evaders import (
    GuaranteedTimesOfTwo as GuaranteedTimesOfTwo,
)
from .systems.numerics.tracking.visibility_game.two_evaders import (
    solve_two_evaders as solve_two_evaders,
)
