#!/bin/sh
# Resolve pyproject.toml into the lock files: names, versions, hashes. What a lock already names is kept while it still
# fits; delete the files first to move everything to the newest versions. Usage: scripts/lock.sh PYTHON
set -eu
python=$1

compile() { # OUTPUT ARGUMENT...
    output=$1
    shift
    "$python" -m uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
        --no-header --no-annotate --no-emit-index-url --output-file "$output" "$@" >/dev/null
}

# The library, the service and the table generator: what `make serve` and the image install.
compile requirements.lock pyproject.toml --extra server --extra fem --group build
# The same versions, and everything that tests, checks, documents and measures.
compile requirements-dev.lock pyproject.toml --all-extras --group build --constraint requirements.lock
# What is installed in an environment of its own: a generator of clients for the tests, peers of `make bench`.
for group in openapi-client tesseract nanite; do
    compile "requirements-$group.lock" --group "$group"
done
