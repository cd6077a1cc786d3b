# The service, from the locked packages. Every path below is checked by scripts/verify_image.py where no engine runs.
FROM python:3.11-slim-bookworm AS builder
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
RUN python3 -m venv /opt/venv
COPY requirements.lock /build/requirements.lock
RUN /opt/venv/bin/pip install --quiet --require-hashes -r /build/requirements.lock
COPY pyproject.toml README.md LICENSE /app/
COPY underskin /app/underskin
COPY service /app/service
COPY tablegen /app/tablegen
COPY rig /app/rig
COPY tables /app/tables
COPY docs/*.md /app/docs/
COPY scripts/client_documents.py scripts/openapi_examples.py /app/scripts/
RUN /opt/venv/bin/pip install --quiet --no-index --no-build-isolation -e '/app[server,fem]'
# The root is read-only later, so byte code, machine code and the examples of the OpenAPI document are written now; the
# packages' own test suites and pip are not needed any more.
RUN python3 -m compileall -q /app && /opt/venv/bin/python -m underskin.compiled && \
    cd /app && /opt/venv/bin/python -m scripts.openapi_examples && \
    find /opt/venv -type d -name tests -prune -exec rm -rf {} + && \
    /opt/venv/bin/pip uninstall --quiet --yes hatchling editables pip

FROM python:3.11-slim-bookworm
# pg_dump and psql, for backups of a store on PostgreSQL.
RUN apt-get update -q && apt-get install -qy --no-install-recommends postgresql-client && rm -rf /var/lib/apt/lists/*
RUN useradd --uid 10001 --user-group --no-create-home --shell /usr/sbin/nologin underskin && \
    install -d -o underskin -g underskin -m 750 /data
COPY --from=builder /opt/venv /opt/venv
COPY --from=builder /app /app
ENV PATH=/opt/venv/bin:/usr/local/bin:/usr/bin:/bin UNDERSKIN_DATA=/data PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
WORKDIR /data
VOLUME /data
USER 10001:10001
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s --retries=3 \
    CMD ["python3", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/health', timeout=4)"]
ENTRYPOINT ["underskin"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8000"]
