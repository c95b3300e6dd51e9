#!/bin/sh
# Checks the models with spin: each holds, and each with a bug put in (-DBUG=n) is refuted. Small bounds: seconds.
# `--long`: larger bounds instead, a minute and up to 2 GB.
set -eu
cd "$(dirname "$0")"
command -v spin >/dev/null || { echo "model: spin is missing; install it: apt-get install spin" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

run() { # model, -Dname=value... ; leaves pan's report in $scratch/report
    model=$1
    shift
    (
        cd "$scratch"
        spin -a "$@" "$OLDPWD/$model.pml" >spin.log 2>&1 || { cat spin.log >&2; exit 1; }
        # shellcheck disable=SC2086
        gcc $pan_flags -w -DSAFETY -DCOLLAPSE -DMEMLIM=4000 -o pan pan.c
        ./pan -m100000 -w"$hash_bits" >report 2>&1 || true
        grep -q '^State-vector' report || { cat report >&2; exit 1; }
    )
}

holds() { # model, bounds
    run "$@"
    if grep -Eq 'Search not completed|reached -DMEMLIM|max search depth too small' "$scratch/report"; then
        echo "model: $*: not searched to its end; more memory or smaller bounds" >&2
        exit 1
    fi
    grep -q 'errors: 0$' "$scratch/report" || {
        grep -v '^Depth=' "$scratch/report" >&2
        echo "model: $* does not hold" >&2
        exit 1
    }
    echo "model: $* holds ($(sed -n 's/ *\([0-9.e+]*\) states, stored.*/\1/p' "$scratch/report") states)"
}

refuted() { # model, bug, bounds
    model=$1 bug=$2
    shift 2
    run "$model" -DBUG="$bug" "$@"
    grep -q 'errors: 1$' "$scratch/report" || { echo "model: $model does not notice its bug $bug" >&2; exit 1; }
}

if [ "${1:-}" = --long ]; then
    pan_flags=-O2 hash_bits=26
    holds publish -DFRAMES=6
    holds publish -DFRAMES=3 -DRINGS=3
    holds publish -DCAPACITY=4 -DBATCH=2 -DFRAMES=6 -DRINGS=1
    holds wait -DREADERS=2
    holds wait -DFRAMES=6 -DKILLS=2
    holds create -DRIVALS=4 -DKILLS=2
    exit 0
fi
pan_flags=-O0 hash_bits=18
holds publish
holds wait
holds create -DRIVALS=3
for bug in 1 2 3 4 5; do refuted publish $bug; done
for bug in 1 2 3 4 5 6 7; do refuted wait $bug; done
for bug in 1 2 3 4; do refuted create $bug -DRIVALS=3; done
echo "model: each of 16 bugs is refuted"
