#!/bin/sh
# Makes firmware/images again, which `make flash` and `whisker flash` take: twice, in two folders; nothing is replaced unless
# both are the same byte for byte. Environment: as tools/firmware/build.sh. The listings stay in build/firmware/images.
set -eu
cd "$(dirname "$0")/../.."
images=firmware/images
scratch=build/firmware/images
rm -rf "$scratch"

for folder in first second/and_deeper; do
    made=$scratch/$folder kept=$scratch/$folder.kept
    OUT=$made tools/firmware/build.sh >/dev/null
    mkdir -p "$kept"
    cp "$made/loader.hex" "$made/node.whex" "$made/node_wire.hex" "$kept/"
    cat "$made/loader.lst" "$made/application.lst" | sed -nE 's/^([0-9a-f]{8}) <([A-Za-z0-9_]+)>:$/\1 \2/p' >"$kept/node.sym"
done
diff -r "$scratch/first.kept" "$scratch/second/and_deeper.kept" >&2 || {
    echo 'images: two builds of the same sources differ; nothing was replaced' >&2
    exit 1
}
cp "$scratch/first.kept"/* "$images/"
cp "$scratch/first/compiler.txt" "$images/COMPILER"
.venv/bin/python tools/firmware/source_hash.py >"$images/SOURCES"
(cd "$images" && sha256sum ./*.hex ./*.whex ./*.sym | sed 's,\./,,' >SHA256SUMS)
echo "images: $images made twice, the same both times; commit it"
