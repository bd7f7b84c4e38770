"""Descriptions of displays: TOML files, presets, Looking Glass calibrations, monitors, prints."""
