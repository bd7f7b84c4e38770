"""Tables, charts and pictures as one HTML page: the paper's system, measured again."""

from lippmann.report.experiment import VARIANTS, Experiment, Manner, Results, Run, Variant, run_experiment
from lippmann.report.page import report_page
from lippmann.report.reproduction import reproduce
from lippmann.report.summary import summary

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
