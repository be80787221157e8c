from .diagrams.vision.make_picture_tracking import AddPictureTracking as AddPictureTracking
from .diagrams.vision.make_picture_tracking import MakePictureTracking as MakePictureTracking
from .diagrams.vision.report import WeightSweep as WeightSweep
from .diagrams.vision.report import draw_estimates as draw_estimates
from .diagrams.vision.report import summarise_picture_tracking as summarise_picture_tracking
from .diagrams.vision.report import sweep_weights as sweep_weights
from .diagrams.vision.report import write_picture_report as write_picture_report
from .diagrams.vision.run import PictureRun as PictureRun
from .diagrams.vision.run import run_picture_tracking as run_picture_tracking
from .diagrams.vision.scenario import OmniOptics as OmniOptics
from .diagrams.vision.scenario import PictureGame as PictureGame
from .diagrams.vision.scenario import PictureQuality as PictureQuality
from .diagrams.vision.scenario import PictureTrackingScenario as PictureTrackingScenario
from .diagrams.vision.scenario import PursuerVision as PursuerVision
from .diagrams.vision.scenario import set_up_picture_game as set_up_picture_game
from .systems.numerics.vision.boards.board import Checkerboard as Checkerboard
from .systems.numerics.vision.boards.board import find_corners as find_corners
from .systems.numerics.vision.boards.calibrate import calibrate_on_board as calibrate_on_board
from .systems.numerics.vision.boards.fit import BoardFit as BoardFit
from .systems.numerics.vision.camera_models.camera_files import (
    load_camera_model as load_camera_model,
)
from .systems.numerics.vision.camera_models.camera_files import (
    save_camera_model as save_camera_model,
)
from .systems.numerics.vision.camera_models.camera_model import CameraModel as CameraModel
from .systems.numerics.vision.camera_models.central_cameras import (
    KannalaBrandtCamera as KannalaBrandtCamera,
)
from .systems.numerics.vision.camera_models.central_cameras import MeiCamera as MeiCamera
from .systems.numerics.vision.camera_models.central_cameras import (
    ScaramuzzaCamera as ScaramuzzaCamera,
)
from .systems.numerics.vision.estimation.calibration import THESIS_DISTANCES as THESIS_DISTANCES
from .systems.numerics.vision.estimation.calibration import Calibration as Calibration
from .systems.numerics.vision.estimation.calibration import calibrate as calibrate
from .systems.numerics.vision.estimation.calibration import load_calibration as load_calibration
from .systems.numerics.vision.estimation.calibration import save_calibration as save_calibration
from .systems.numerics.vision.estimation.labelled_pictures import LabelledPicture as LabelledPicture
from .systems.numerics.vision.estimation.labelled_pictures import load_pictures as load_pictures
from .systems.numerics.vision.estimation.labelled_pictures import read_pictures as read_pictures
from .systems.numerics.vision.estimation.labelled_pictures import save_pictures as save_pictures
from .systems.numerics.vision.estimation.labelled_pictures import (
    simulated_pictures as simulated_pictures,
)
from .systems.numerics.vision.estimation.pictures import load_picture as load_picture
from .systems.numerics.vision.estimation.pictures import save_picture as save_picture
from .systems.numerics.vision.estimation.position_filter import Track as Track
from .systems.numerics.vision.estimation.position_filter import correct as correct
from .systems.numerics.vision.estimation.position_filter import predict as predict
from .systems.numerics.vision.estimation.position_filter import start_track as start_track
from .systems.numerics.vision.estimation.range_models import (
    exact_pixel_radius as exact_pixel_radius,
)
from .systems.numerics.vision.estimation.range_models import exact_range as exact_range
from .systems.numerics.vision.estimation.range_models import implied_k as implied_k
from .systems.numerics.vision.estimation.range_models import k_values as k_values
from .systems.numerics.vision.estimation.range_models import thesis_range as thesis_range
from .systems.numerics.vision.estimation.shell_detection import ShellColour as ShellColour
from .systems.numerics.vision.estimation.shell_detection import ShellDetection as ShellDetection
from .systems.numerics.vision.estimation.shell_detection import chosen_colours as chosen_colours
from .systems.numerics.vision.estimation.shell_detection import detect_shells as detect_shells
from .systems.numerics.vision.estimation.shell_estimate import ShellEstimate as ShellEstimate
from .systems.numerics.vision.estimation.shell_estimate import estimate_shell as estimate_shell
from .systems.numerics.vision.estimation.shell_estimate import locate as locate
from .systems.numerics.vision.omni_optics import OmniCamera as OmniCamera
from .systems.numerics.vision.omni_optics import RayTable as RayTable
from .systems.numerics.vision.omni_optics import floor_range as floor_range
from .systems.numerics.vision.omni_optics import make_ray_table as make_ray_table
from .systems.numerics.vision.omni_optics import pixel_rays as pixel_rays
from .systems.numerics.vision.omni_optics import project_omni as project_omni
from .systems.numerics.vision.rendering import render as render
from .systems.numerics.vision.sensor import Sensor as Sensor
from .systems.numerics.vision.sensor import expose as expose
from .systems.numerics.vision.surroundings import Shell as Shell
from .systems.numerics.vision.surroundings import Surroundings as Surroundings
from .systems.numerics.vision.surroundings import shell_of as shell_of
from .systems.vision import EvaderTracker as EvaderTracker
from .systems.vision import OmniCameraSensor as OmniCameraSensor
from .systems.vision import ShellEstimator as ShellEstimator
