# Lippmann in a container, on the CPU:
#   docker build -t lippmann .
#   docker run --rm -v "$PWD:/work" lippmann render model.glb -o model.png
# With an NVIDIA GPU (its container toolkit brings the driver's libraries, OptiX among them):
#   docker build -t lippmann-gpu --build-arg BASE=nvidia/cuda:12.9.1-base-ubuntu24.04 .
#   docker run --rm --gpus all -v "$PWD:/work" lippmann-gpu render model.glb -o model.png
# The checks of `make check`, in an image that is thrown away:
#   docker build --target check .

ARG BASE=debian:trixie-slim

FROM ${BASE} AS system
ENV DEBIAN_FRONTEND=noninteractive PIP_NO_CACHE_DIR=1
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libatomic1 libllvm19 make python3 python3-venv \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /lippmann

FROM system AS check
COPY . .
RUN make check

FROM system AS lippmann
COPY pyproject.toml README.md LICENSE ./
COPY src src
RUN python3 -m venv /opt/lippmann && /opt/lippmann/bin/pip install .
# OptiX is part of what the toolkit calls graphics.
ENV PATH=/opt/lippmann/bin:$PATH NVIDIA_DRIVER_CAPABILITIES=compute,graphics,utility
WORKDIR /work
ENTRYPOINT ["lippmann"]
CMD ["--help"]
