#!/bin/sh
# Build the environment: missing Debian packages first, then the virtual environment with pinned versions.
set -eu
PYTHON=${PYTHON:-python3}
VENV=${VENV:-.venv}

"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "Tubefoot needs Python 3.11 or later; set PYTHON=/path/to/python3.11" >&2
    exit 1
}

if command -v dpkg-query >/dev/null 2>&1; then
    missing=""
    for package in $(sed 's/#.*//' scripts/debian-packages.txt); do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || missing="$missing $package"
    done
    if [ -n "$missing" ]; then
        if [ "$(id -u)" = 0 ]; then
            apt-get update -qq
            DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
        else
            echo "Some Debian packages are missing. Run this line, then repeat:" >&2
            echo "    sudo apt-get install --no-install-recommends$missing" >&2
            exit 1
        fi
    fi
else
    echo "Not a Debian system: please provide what scripts/debian-packages.txt lists." >&2
fi

[ -x "$VENV/bin/python" ] || "$PYTHON" -m venv "$VENV"
"$VENV/bin/python" -m pip install --quiet --constraint constraints.txt --editable '.[all,dev,docs]'
