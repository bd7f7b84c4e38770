"""The lens that is really there: profiles, the path of light through them, light tables, true directions, proofs.

Lengths are millimetres. ``trace`` is the readable twin of the compiled ``trace_kernel``.
"""
