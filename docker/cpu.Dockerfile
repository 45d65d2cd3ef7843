# docker build -f docker/cpu.Dockerfile -t fingers .
# docker run --rm -v "$PWD/runs:/runs" fingers train crawl --preset cpu --out /runs/first
FROM python:3.11-slim
RUN pip install --no-cache-dir uv
WORKDIR /opt/fingers
COPY . .
RUN uv sync --locked --no-dev --extra viz --extra data --no-cache
ENTRYPOINT ["/opt/fingers/.venv/bin/fingers"]
CMD ["doctor"]
