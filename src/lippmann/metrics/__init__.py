"""Metrics of a picture against a reference: PSNR, SSIM, flicker, and those of the 2014 paper."""

from lippmann.metrics.comparison import Comparison, check_comparable, compare
from lippmann.metrics.error_image import error_map
from lippmann.metrics.flicker import Flicker
from lippmann.metrics.mse_psnr import MicroImage, low_percentile, micro_image_means, psnr, squared_errors
from lippmann.metrics.paper import PaperFigures, paper_psnr, paper_rmse
from lippmann.metrics.silhouettes import Silhouettes, SilhouetteShare, find_silhouettes
from lippmann.metrics.structural_similarity import ViewSimilarity, ssim
from lippmann.metrics.view_metrics import view_flicker, view_similarity

__all__ = [
    "Comparison",
    "Flicker",
    "MicroImage",
    "PaperFigures",
    "SilhouetteShare",
    "Silhouettes",
    "ViewSimilarity",
    "check_comparable",
    "compare",
    "error_map",
    "find_silhouettes",
    "low_percentile",
    "micro_image_means",
    "paper_psnr",
    "paper_rmse",
    "psnr",
    "squared_errors",
    "ssim",
    "view_flicker",
    "view_similarity",
]
