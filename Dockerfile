# knittest with compiled kernels, run by a user without rights. Build it in a checkout:
#   docker build -t knittest . && docker run --rm -v "$PWD/runs:/data/runs" knittest demo --no-open
FROM python:3.13-slim AS build
WORKDIR /src
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:3.13-slim
# OpenMP for the threads of the kernels
RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
COPY --from=build /wheels /wheels
RUN pip install --no-cache-dir /wheels/*.whl && rm -r /wheels
RUN useradd --create-home --uid 1000 knittest && install -d -o knittest -g knittest /data
USER knittest
WORKDIR /data
# for the processor of the machine that builds; on another one, each container compiles again
RUN knittest warmup
ENTRYPOINT ["knittest"]
CMD ["--help"]
