"""Tables, charts and pictures as one HTML page: the paper's system, measured again."""

from lippmann.reproduce.experiment import VARIANTS, Experiment, Manner, Results, Run, Variant, run_experiment
from lippmann.reproduce.page import report_page
from lippmann.reproduce.run import reproduce
from lippmann.reproduce.summary import summary

__all__ = [
    "VARIANTS",
    "Experiment",
    "Manner",
    "Results",
    "Run",
    "Variant",
    "report_page",
    "reproduce",
    "run_experiment",
    "summary",
]
