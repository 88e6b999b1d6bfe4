#!/bin/sh
# Puts uPlot, which draws plots over time in reports, into this folder: the published files, pinned and checked.
# https://github.com/leeoniya/uPlot, MIT (LICENSE).
set -eu
version=1.6.32
sha512='KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw=='

here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm pack --silent "uplot@$version" > /dev/null
found=$(openssl dgst -sha512 -binary "uplot-$version.tgz" | base64 -w0)
if [ "$found" != "$sha512" ]; then
  echo "uplot-$version.tgz: SHA-512 is $found and should be $sha512" >&2
  exit 1
fi
tar xzf "uplot-$version.tgz"
for file in dist/uPlot.iife.min.js dist/uPlot.min.css LICENSE; do
  cp "package/$file" "$here/$(basename "$file").partial"
  mv "$here/$(basename "$file").partial" "$here/$(basename "$file")"
done
