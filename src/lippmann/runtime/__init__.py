"""The machine: rendering engine, LLVM, GPU, compiled kernels, threads, child processes and atomic file writes."""
