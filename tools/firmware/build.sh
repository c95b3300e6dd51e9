#!/bin/sh
# Builds the node's firmware with XC16 or XC-DSC: build/firmware/node.whex (for `whisker flash`) and node_wire.hex (for
# `make flash`). Not yet run on silicon: the image's build options say so.
# Environment: SENSOR (mlx90333, or mlx90316), RESYNC (1: before every frame, at 1.4 kHz, for sensors that refuse frames back
# to back), VERSION (0.1), MDFP (device pack), OUT (where to).
set -eu
cd "$(dirname "$0")/../.."
out=${OUT:-build/firmware}
fw=firmware/dspic
flags=0x8000 defines='' decoder=sensor_frame.c # flags: the image's build options; bit 15: not yet run on silicon
case ${SENSOR:-mlx90333} in
    mlx90333) ;;
    mlx90316) flags=0x8001 defines=-DSENSOR_MLX90316 decoder=sensor_frame_90316.c ;;
    *) echo "firmware: SENSOR=$SENSOR: not known; use mlx90333 or mlx90316" >&2 && exit 1 ;;
esac
case ${RESYNC:-0} in
    0) ;;
    1)
        [ -z "$defines" ] || { echo 'firmware: RESYNC=1 is for the MLX90333 only; leave SENSOR out' >&2 && exit 1; }
        flags=0x8002 defines=-DSAMPLER_RESYNC_EVERY_FRAME
        ;;
    *) echo "firmware: RESYNC=$RESYNC: use 1, or leave it out" >&2 && exit 1 ;;
esac
compiler=$(command -v xc16-gcc || command -v xc-dsc-gcc || true)
if [ -z "$compiler" ]; then
    echo 'firmware: neither xc16-gcc nor xc-dsc-gcc is on PATH; install MPLAB XC-DSC or XC16 (microchip.com, the free' >&2
    echo 'firmware: edition will do) and add its bin folder to PATH. Without it the firmware runs in simulation only.' >&2
    exit 1
fi
tools=${compiler%gcc}
mkdir -p "$out"

# The compiler's own linker script, with the program memory of one of the two, and without the vector tables that older
# ones bring: vectors.s and the jump table take their place.
script() { # name origin end
    gld=$(find "$(dirname "$compiler")/.." ${MDFP:+"$MDFP"} -name p33FJ128MC802.gld | head -1)
    [ -n "$gld" ] || { echo 'firmware: no p33FJ128MC802.gld; name the device pack with MDFP=FOLDER' >&2; exit 1; }
    sed -E -e "s/(program *\(xr\) *: *ORIGIN *= *)0x[0-9A-Fa-f]+, *LENGTH *= *0x[0-9A-Fa-f]+/\1$2, LENGTH = $(printf '0x%X' $(($3 - $2)))/" \
        -e '/\.a?ivt +__A?IVT_BASE/,/\} *> *a?ivt/d' "$gld" >"$out/$1.gld"
    grep -q "ORIGIN = $2" "$out/$1.gld" || { echo "firmware: $gld: no program region to move" >&2; exit 1; }
}

build() { # name, defines and link options, extra sources
    name=$1 options=$2
    shift 2
    # shellcheck disable=SC2086
    "$compiler" -mcpu=33FJ128MC802 ${MDFP:+"-mdfp=$MDFP"} -omf=elf -std=gnu99 -O1 -merrata=exch -Wall -Wextra -Werror \
        -I$fw -I$fw/core -I$fw/port_dspic -Iprotocol/gen $defines $options $core $fw/boot/*.c $fw/port_dspic/*.c \
        $fw/port_dspic/chip/main.c "$@" -o "$out/$name.elf" \
        -Wl,--script="$out/$name.gld",--stack=16,--check-sections,--data-init,--handles,--report-mem,--no-ivt
    "${tools}bin2hex" "$out/$name.elf"
    "${tools}objdump" -d "$out/$name.elf" >"$out/$name.lst"
}

core=$fw/core/$decoder # one of the two decoders, and everything else
for source in $fw/core/*.c; do
    case $source in
        */sensor_frame*.c) ;;
        *) core="$core $source" ;;
    esac
done

script loader 0x200 0x2000
script application 0x2280 0x15800
rm -f "$out"/*.elf "$out"/*.hex
build loader -DNODE_LOADER $fw/port_dspic/chip/config.c $fw/port_dspic/chip/vectors.s
build application '' $fw/port_dspic/chip/jump_table.s
.venv/bin/python tools/firmware/check_listing.py "$out/application.lst" >"$out/cycles.txt"
.venv/bin/python tools/firmware/make_image.py image "$out/application.hex" "$out/node.whex" --version "${VERSION:-0.1}" --options $flags
.venv/bin/python tools/firmware/make_image.py wire "$out/loader.hex" "$out/node_wire.hex" --app "$out/application.hex" \
    --version "${VERSION:-0.1}" --options $flags
echo "firmware: $out/node.whex and $out/node_wire.hex, not yet run on silicon; cycles of the sample path in $out/cycles.txt"
