#!/bin/sh
# Builds what the image holds into a folder: the evaluator, bundled scenes and grids.
#   deploy/container/build.sh FOLDER [PROFILE]
# PROFILE is one of cargo's, by default release.
set -eu
folder=${1:?names the folder to write}
profile=${2:-release}
cd "$(dirname "$0")/../.."
cargo build --locked --package halflight-evaluator --bin evaluator --profile "$profile"
# Cargo calls the folder of the profile dev by another name.
built=$profile
[ "$profile" != dev ] || built=debug
mkdir -p "$folder/bin"
cp "${CARGO_TARGET_DIR:-target}/$built/evaluator" "$folder/bin/"
# Grids name the scene files by their path from here.
mkdir -p "$folder/scenes" "$folder/grids"
cp scenes/*.toml scenes/*.exr "$folder/scenes/"
cp grids/*.toml "$folder/grids/"
