"""The machine under the program: engine, LLVM, GPU, compiled kernels, threads, and files that appear whole."""
