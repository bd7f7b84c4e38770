"""Tachyon scene files (``.dat``)."""
