#!/bin/sh
# Makes firmware/images again, which `make flash` and `whisker flash` take: each build of the firmware, twice, in two folders;
# nothing is replaced unless both are the same byte for byte. Environment: as tools/firmware/build.sh, SENSOR and RESYNC apart.
set -eu
cd "$(dirname "$0")/../.."
images=firmware/images
scratch=build/firmware/images
rm -rf "$scratch"

make_one() { # name, setting
    for folder in first second/and_deeper; do
        env "$2" OUT="$scratch/$folder/$1" tools/firmware/build.sh >/dev/null
        made=$scratch/$folder/$1
        cat "$made/loader.lst" "$made/application.lst" >"$made/node.lst"
        for file in loader.hex node.whex node_wire.hex node.lst; do
            mkdir -p "$scratch/$folder.kept/$1"
            cp "$made/$file" "$scratch/$folder.kept/$1/"
        done
    done
}

make_one mlx90333 SENSOR=mlx90333
make_one mlx90316 SENSOR=mlx90316
make_one resync RESYNC=1
diff -r "$scratch/first.kept" "$scratch/second/and_deeper.kept" >&2 || {
    echo 'images: two builds of the same sources differ; nothing was replaced' >&2
    exit 1
}
cp -r "$scratch/first.kept/." "$images/"
cp "$scratch/first/mlx90333/compiler.txt" "$images/COMPILER"
.venv/bin/python tools/firmware/source_hash.py >"$images/SOURCES"
(cd "$images" && sha256sum */*.hex */*.whex */*.lst >SHA256SUMS)
echo "images: $images made twice, the same both times; commit it"
