"""How far a picture is from a reference: the paper's figures and the standard ones."""

from lippmann.quality.comparison import Comparison, check_comparable, compare
from lippmann.quality.error_picture import error_map
from lippmann.quality.flicker import Flicker
from lippmann.quality.metrics import MicroImage, low_percentile, micro_image_means, psnr, squared_errors
from lippmann.quality.paper import PaperFigures, paper_figures, paper_psnr, paper_rmse
from lippmann.quality.silhouettes import Silhouettes, find_silhouettes
from lippmann.quality.similarity import ViewSimilarity, ssim
from lippmann.quality.views import view_flicker, view_similarity

__all__ = [
    "Comparison",
    "Flicker",
    "MicroImage",
    "PaperFigures",
    "Silhouettes",
    "ViewSimilarity",
    "check_comparable",
    "compare",
    "error_map",
    "find_silhouettes",
    "low_percentile",
    "micro_image_means",
    "paper_figures",
    "paper_psnr",
    "paper_rmse",
    "psnr",
    "squared_errors",
    "ssim",
    "view_flicker",
    "view_similarity",
]
