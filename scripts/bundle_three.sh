#!/bin/sh
# Bundle three.js anew into src/tubefoot/vendored/three. Needs npm; only for those who change scripts/three.
set -eu
cd "$(dirname "$0")/.."
work=build/three
mkdir -p "$work"
cp scripts/three/package.json scripts/three/entry.js "$work"
(cd "$work" && npm install --silent --no-package-lock && npx esbuild entry.js --bundle --minify --format=esm \
    --target=es2021 --legal-comments=inline --outfile=three.min.js)
cp "$work/three.min.js" "$work/node_modules/three/LICENSE" src/tubefoot/vendored/three/
