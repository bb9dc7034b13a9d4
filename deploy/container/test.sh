#!/bin/sh
# Does what the image's steps do, without a container engine: builds into a folder, and measures a small grid with what
# is in that folder alone, on lavapipe. With debootstrap and root, the second stage runs in a fresh Debian.
#   deploy/container/test.sh [PROFILE]
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d /tmp/halflight-container.XXXXXX)
trap 'rm -rf --one-file-system "$work"' EXIT
root=$work/root
"$here/build.sh" "$work/opt" "${1:-release}"
in_root="env -i"
if command -v debootstrap > /dev/null && [ "$(id -u)" = 0 ]; then
    debootstrap --variant=minbase bookworm "$root" > "$work/log" 2>&1 || {
        tail -n 20 "$work/log" >&2
        exit 1
    }
    cp "$here/install.sh" "$root/tmp/install.sh"
    chroot "$root" /tmp/install.sh > "$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; exit 1; }
    mkdir -p "$root/opt"
    cp -r "$work/opt" "$root/opt/halflight"
    in_root="chroot $root env -i"
    home=/opt/halflight data=/tmp/data
    at=$root
else
    echo "debootstrap or root is missing: the second stage runs on this system"
    home=$work/opt data=$work/data at=
fi
mkdir -p "$at$data"
cat > "$at$data/grid.toml" <<'GRID'
scenes = ["scenes/cornell.toml"]
size = ["32x32"]
frames = 1
truth_samples = 4
[[sweep]]
technique = "hierarchical"
fixed = { samples = 4 }
GRID
# As the image's ENTRYPOINT in its WORKDIR with its ENV.
$in_root sh -c "cd $home && PATH=$home/bin:/usr/bin:/bin XDG_RUNTIME_DIR=/tmp HALFLIGHT_CACHE=$data/cache \
    exec evaluator run --grid $data/grid.toml --out $data/report --adapter software"
grep -q llvmpipe "$at$data/report/results.csv" || { echo "error: no row of lavapipe" >&2; exit 1; }
echo "the image's steps work: $(wc -c < "$work/opt/bin/evaluator") bytes of program"
