FROM python:3.11-slim-bookworm

# OpenGL without a screen.
RUN apt-get update \
    && apt-get install -y --no-install-recommends libosmesa6 \
    && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml constraints.txt README.md LICENSE /src/
COPY src /src/src
COPY packages /src/packages
RUN pip install --no-cache-dir --only-binary :all: -c /src/constraints.txt "/src[pages,import,lab,networks,next-object]" \
        /src/packages/torc-lab /src/packages/torc-networks /src/packages/torc-next-object

# Compiled kernels are cached beside the package, or here where that is read-only.
ENV NUMBA_CACHE_DIR=/var/cache/torc
RUN mkdir -m 1777 /var/cache/torc

WORKDIR /work
ENTRYPOINT ["torc"]
