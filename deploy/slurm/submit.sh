#!/bin/bash
# Submits a grid as an array of TASKS and, behind it, the merge. OPTIONS are those of sbatch, such as --gpus=1.
#   deploy/slurm/submit.sh GRID.toml FOLDER TASKS [OPTIONS]
# The report is FOLDER/report. Where cells are missing, the merge fails and FOLDER/report/missing.toml is their grid:
# measure it into FOLDER/part-again and submit merge.sbatch once more.
set -euo pipefail
if [ $# -lt 3 ]; then
    echo "usage: submit.sh GRID.toml FOLDER TASKS [OPTIONS OF sbatch]" >&2
    exit 2
fi
grid=$1 folder=$2 tasks=$3
shift 3
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$folder"
array=$(sbatch --parsable --array="0-$((tasks - 1))" --output="$folder/part-%a.log" "$@" \
    "$here/cells.sbatch" "$grid" "$folder")
merge=$(sbatch --parsable --dependency="afterany:$array" --output="$folder/merge.log" "$here/merge.sbatch" "$folder")
echo "$array $merge"
