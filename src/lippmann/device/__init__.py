"""Scenes on the device: Mitsuba scenes, Whitted scenes, the Sobol stream, and array operations of Dr.Jit."""
