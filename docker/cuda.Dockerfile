# docker build -f docker/cuda.Dockerfile -t fingers-cuda .
# docker run --rm --gpus all -v "$PWD/runs:/runs" fingers-cuda train crawl --out /runs/first
# CUDA comes with JAX's wheels; the host needs the NVIDIA driver (525 or newer) and its
# container toolkit. For drivers from 580 on: --build-arg EXTRA=cuda13.
FROM python:3.12-slim
ARG EXTRA=cuda12
# The driver's libraries for OpenGL too, and what finds them: pictures are drawn by EGL.
ENV NVIDIA_DRIVER_CAPABILITIES=all
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libegl1 libopengl0 \
    && rm -rf /var/lib/apt/lists/*
RUN pip install --no-cache-dir uv
WORKDIR /opt/fingers
COPY . .
RUN uv sync --locked --no-default-groups --extra viz --extra data --extra viewer \
    --extra ${EXTRA} --no-cache
ENTRYPOINT ["/opt/fingers/.venv/bin/fingers"]
CMD ["doctor"]
