# docker build -f docker/cpu.Dockerfile -t fingers .
# docker run --rm -v "$PWD/runs:/runs" fingers train crawl --preset cpu --out /runs/first
# docker run --rm --network host fingers play --viewer
FROM python:3.11-slim
RUN pip install --no-cache-dir uv
WORKDIR /opt/fingers
COPY . .
RUN uv sync --locked --no-default-groups --extra viz --extra data --extra viewer --no-cache
ENTRYPOINT ["/opt/fingers/.venv/bin/fingers"]
CMD ["doctor"]
