#!/bin/sh
# Create a virtual environment with the first Python >= 3.11 that can. Usage: scripts/make-venv.sh DIRECTORY
set -eu
found=
for python in python3.11 python3.12 python3.13 python3.14 python3; do
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue
    found=$python
    "$python" -c 'import ensurepip, venv' 2>/dev/null || continue
    "$python" -m venv "$1"
    exit
done

if [ -n "$found" ]; then
    echo "$found cannot make virtual environments: its venv module is missing." >&2
    echo "On Debian and Ubuntu: apt-get install $("$found" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')" >&2
else
    echo "No Python 3.11 or newer was found (looked for python3.11 to python3.14 and python3)." >&2
    echo "On Debian 12 and later: apt-get install python3 python3-venv" >&2
fi
exit 1
