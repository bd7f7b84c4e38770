"""Test patterns by which a person finds a monitor's pitch, slope and centre."""

from lippmann.calibration.patterns import NAMES, Field, Pattern, draw, fields, whole

__all__ = ["NAMES", "Field", "Pattern", "draw", "fields", "whole"]
