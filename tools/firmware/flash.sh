#!/bin/sh
# First programming of a node by wire: loader, application and serial number in one go.
# flash.sh --tool ipecmd|pk2cmd|picberry --hex WIRE.hex [--serial N] [--dry-run]
# `make firmware` makes WIRE.hex. Environment: IPECMD_TOOL (PPK3: a PICkit 3), PICBERRY_FAMILY (dspic33f), PICBERRY_PINS.
set -eu
cd "$(dirname "$0")/../.."
tool='' hex=build/firmware/node_wire.hex serial='' dry_run=''

fail() {
    echo "flash: $1" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case $1 in
        --tool | --hex | --serial) [ $# -gt 1 ] || fail "$1: wants a value; see the top of tools/firmware/flash.sh" ;;
    esac
    case $1 in
        --tool) tool=$2 && shift ;;
        --hex) hex=$2 && shift ;;
        --serial) serial=$2 && shift ;;
        --dry-run) dry_run=yes ;;
        *) fail "$1: not an option; see the top of tools/firmware/flash.sh" ;;
    esac
    shift
done

case $tool in
    ipecmd) places='ipecmd ipecmd.sh' from='MPLAB X with its IPE (microchip.com); ipecmd.sh lies in mplab_platform/mplab_ipe' ;;
    pk2cmd) places='pk2cmd' from='pk2cmd for the PICkit 2; its device list must know the dsPIC33FJ128MC802' ;;
    picberry) places='picberry' from='picberry (github.com/WallaceIT/picberry) on a Raspberry Pi' ;;
    '') fail 'which programmer? make flash TOOL=ipecmd, TOOL=pk2cmd or TOOL=picberry' ;;
    *) fail "TOOL=$tool: not known; use ipecmd, pk2cmd or picberry" ;;
esac
case $serial in
    *[!0-9]* | 0) fail "SERIAL=$serial: give a whole number from 1, another for each node" ;;
esac

program=''
for name in $places; do
    [ -n "$program" ] || program=$(command -v "$name" || true)
done
[ -n "$program" ] || [ -n "$dry_run" ] || fail "$tool: not found on PATH; install $from"
[ -n "$program" ] || program=$tool
[ -r "$hex" ] || fail "$hex: not there; run 'make firmware' first, or name another with HEX=FILE"

if [ -n "$serial" ]; then
    mkdir -p build/firmware
    numbered=build/firmware/node_$serial.hex
    .venv/bin/python tools/firmware/make_image.py wire "$hex" "$numbered" --serial "$serial" --whole || exit 1
    hex=$numbered
else
    echo 'flash: no SERIAL=n: the node cannot be addressed alone by its number' >&2
fi

case $tool in
    ipecmd) set -- "$program" -P33FJ128MC802 "-TP${IPECMD_TOOL:-PPK3}" -M "-F$hex" -OL ;;
    pk2cmd) set -- "$program" -PdsPIC33FJ128MC802 -M "-F$hex" -Y -R ;;
    picberry) set -- "$program" -w ${PICBERRY_PINS:+-g "$PICBERRY_PINS"} -f "${PICBERRY_FAMILY:-dspic33f}" -i "$hex" ;;
esac
if [ -n "$dry_run" ]; then
    echo "$*"
    exit 0
fi
"$@" || fail "$tool failed; check supply (3.3 V), the wires PGC, PGD, MCLR and ground, then try again"
