#!/bin/sh
# Builds the node's firmware: node.whex (for `whisker flash`), node_wire.hex (for `make flash`), and what they are made of.
# With XC16 or XC-DSC on PATH, or PIC30=DIR: a folder with cc1, as, ld, bin2hex, objdump and c30_device.info of a public build of
# the compiler's sources. Start-up, string functions and linker script are this repository's: nothing of a vendor's library is
# linked. Not yet run on silicon: the build options say so.
# Environment: VERSION (0.1), MDFP (device pack of XC-DSC), OUT (where to).
set -eu
cd "$(dirname "$0")/../.."
LC_ALL=C && export LC_ALL # the order of the sources
out=${OUT:-build/firmware}
fw=firmware/dspic
chip=$fw/port_dspic/chip
flags=0x8000 # the image's build options; bit 15: not yet run on silicon

fail() {
    for line in "$@"; do echo "firmware: $line" >&2; done
    exit 1
}

# -fno-builtin: what GCC 4.5.1 makes of memset(.., 0xFF, ..) by itself writes 0xFEFF.
cflags="-std=gnu99 -O1 -merrata=exch -fno-builtin -Wall -Wextra -Werror -nostdinc -I$chip/libc -I$fw -I$fw/core -I$fw/port_dspic
    -Iprotocol/gen"
lflags='--stack=16 --check-sections --no-data-init --no-handles --no-isr --report-mem'
if [ -n "${PIC30:-}" ]; then
    # They look for the list of devices beside themselves, then a folder above, and so on each time they read it.
    tools=$out/pic30/bin/bin/
    mkdir -p "$tools"
    for name in cc1 as ld bin2hex objdump c30_device.info; do
        found=$(find -L "$PIC30" -maxdepth 4 -name "$name" -type f | head -1)
        [ -n "$found" ] || fail "PIC30=$PIC30: no $name in it; name the folder of a whole pic30 build"
        ln -sf "$(realpath "$found")" "$tools$name"
    done
    for folder in "$out/pic30" "$out/pic30/bin"; do ln -sf "$(realpath "$tools/c30_device.info")" "$folder/"; done
    version=$("${tools}cc1" -version -o /dev/null </dev/null 2>&1 >/dev/null | head -1 | sed 's/ Build date.*//')
    assemble() { "${tools}as" -p33FJ128MC802 -omf=elf --relax "$1" -o "$2"; }
    compile() { # source, object, defines
        # shellcheck disable=SC2086
        "${tools}cc1" -quiet "-mresource=${tools}../../c30_device.info" -mcpu=33FJ128MC802 $cflags $3 "$1" -o "${2%.o}.s"
        assemble "${2%.o}.s" "$2"
    }
    link() { "${tools}ld" -p33FJ128MC802 -omf=elf "$@"; }
else
    compiler=$(command -v xc16-gcc || command -v xc-dsc-gcc || true)
    [ -n "$compiler" ] || fail 'neither xc16-gcc nor xc-dsc-gcc is on PATH; install MPLAB XC-DSC or XC16 (microchip.com, the free' \
        'edition will do) and add its bin folder to PATH, or name a public pic30 build with PIC30=DIR.' \
        'No compiler is needed to program a node: make flash takes the images of firmware/images.'
    tools=${compiler%gcc}
    version=$("$compiler" --version | head -1)
    # Newer linkers make vector tables of their own unless they are reported not to.
    if "${tools}ld" --help 2>&1 | grep -q -e --no-ivt; then lflags="$lflags --no-ivt"; fi
    # shellcheck disable=SC2086
    compile() { "$compiler" -mcpu=33FJ128MC802 ${MDFP:+"-mdfp=$MDFP"} -omf=elf $cflags $3 -c "$1" -o "$2"; }
    assemble() { compile "$1" "$2" ''; }
    link() {
        "$compiler" -mcpu=33FJ128MC802 ${MDFP:+"-mdfp=$MDFP"} -omf=elf -nostartfiles -nodefaultlibs \
            "-Wl,$(echo "$@" | tr ' ' ,)"
    }
fi

# PROGRAM.hex and PROGRAM.lst from the sources that both programs share and the program's own.
build() { # name, origin, end, define, extra sources
    name=$1 origin=$2 end=$3 define=$4 objects=''
    shift 4
    mkdir -p "$out/$name"
    sed -e "s/@ORIGIN@/$origin/" -e "s/@LENGTH@/$(printf '0x%X' $((end - origin)))/" "$chip/node.gld" >"$out/$name.gld"
    for source in $core $fw/boot/*.c $fw/port_dspic/*.c "$chip/main.c" "$chip/start.s" "$chip/string.c" "$@"; do
        object=$out/$name/$(basename "${source%.*}").o
        case $source in
            *.s) assemble "$source" "$object" ;;
            *) compile "$source" "$object" "$define" ;;
        esac
        objects="$objects $object"
    done
    # shellcheck disable=SC2086
    link $lflags --script="$out/$name.gld" -o "$out/$name.elf" $objects >"$out/$name.mem" 2>"$out/$name.err" || {
        cat "$out/$name.err" >&2
        exit 1
    }
    if "${tools}objdump" -h "$out/$name.elf" | grep -E ' \.n?(bss|data) '; then
        fail "$name has variables outside struct board; the start-up neither clears nor fills them, so put them into it"
    fi
    "${tools}bin2hex" "$out/$name.elf"
    "${tools}objdump" -d "$out/$name.elf" | sed -e '/file format/d' -e 's/_0x[0-9a-f]*_at_address/_at_address/' >"$out/$name.lst"
}

core='' # in this order: another makes another image
for name in sensor_frame crc32 node record sampler service; do core="$core $fw/core/$name.c"; done

rm -rf "$out/loader" "$out/application"
rm -f "$out"/*.hex "$out"/*.whex "$out"/*.lst
build loader 0x200 0x2000 -DNODE_LOADER "$chip/config.c" "$chip/vectors.s"
build application 0x2280 0x15800 '' "$chip/jump_table.s"
python=.venv/bin/python
$python tools/firmware/check_listing.py "$out/application.lst" >"$out/cycles.txt"
$python tools/firmware/make_image.py image "$out/application.hex" "$out/node.whex" --version "${VERSION:-0.1}" --options $flags
$python tools/firmware/make_image.py wire "$out/loader.hex" "$out/node_wire.hex" --app "$out/application.hex" \
    --version "${VERSION:-0.1}" --options $flags

# Other programs of the same version may choose other registers.
program() {
    case $1 in
        cc1 | as | ld) [ -n "${PIC30:-}" ] || { "$compiler" "-print-prog-name=$1" && return; } ;;
    esac
    command -v "$tools$1"
}
{
    echo "version: $version"
    echo "host: $(uname -sm)"
    for name in cc1 as ld bin2hex; do
        path=$(program "$name")
        if [ -r "$path" ]; then echo "$name: $(sha256sum <"$path" | cut -d ' ' -f 1)"; else echo "$name: not recorded"; fi
    done
} >"$out/compiler.txt"
echo "firmware: $out/node.whex and $out/node_wire.hex, not yet run on silicon; cycles of the sample path in $out/cycles.txt"
