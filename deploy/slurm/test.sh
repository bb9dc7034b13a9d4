#!/bin/bash
# Runs deploy/slurm on a cluster of its own: munged, slurmctld and slurmd on 127.0.0.1, started and stopped here. Needs
# root and Debian's munge, slurmctld, slurmd and slurm-client; EVALUATOR is the program. `cargo xtask test --cluster`
# provides both.
#
# An array of 4 measures 40 cells. One task is killed and started again by Slurm. The folder of another is lost and
# measured again by the grid of the missing cells. The merged report must equal that of a single run, bit for bit in
# every error, image and setting.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
: "${EVALUATOR:?is not set: set it to the program evaluator}"
export EVALUATOR XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/tmp}
work=$(mktemp -d /tmp/halflight-slurm.XXXXXX)
export SLURM_CONF=$work/slurm.conf
say() { echo "== $*"; }
fail() {
    echo "error: $*" >&2
    tail -n 20 "$work"/log/* "$work"/out/*.log 2>/dev/null >&2 || true
    exit 1
}

# Process numbers of what was started, last first.
daemons=()
stop() {
    # Jobs that still run are Slurm's.
    if [ -n "${ready:-}" ]; then scancel --user=root 2>/dev/null || true; sleep 1; fi
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
    for pid in "${daemons[@]}"; do
        for _ in $(seq 50); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
        kill -KILL "$pid" 2>/dev/null || true
    done
    if [ -n "${KEEP:-}" ]; then echo "kept: $work"; else rm -rf "$work"; fi
}
trap stop EXIT

mkdir -p "$work"/{munge,state,spool,log,out}
chmod 755 "$work"
chmod 700 "$work/munge"
# Not in a folder that others can write to: munge refuses that.
chown root:root "$work" "$work/munge"
dd if=/dev/urandom of="$work/munge/key" bs=128 count=1 status=none
chmod 400 "$work/munge/key"
socket=$work/run/munge.socket
mkdir -m 755 "$work/run"
node=$(hostname -s)
cat > "$SLURM_CONF" <<CONF
ClusterName=halflight
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
# A task that is started again waits for this long, seconds.
AuthInfo=socket=$socket,cred_expire=5
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/log/slurmctld
SlurmdLogFile=$work/log/slurmd
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
# A batch script ends with 137 where its program was killed.
RequeueExit=137
NodeName=$node NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF

say "starting munged, slurmctld and slurmd"
munged --foreground --force --key-file="$work/munge/key" --socket="$socket" --pid-file="$work/munge/pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed" 2> "$work/log/munged" &
daemons=($! "${daemons[@]}")
for _ in $(seq 100); do [ -S "$socket" ] && break; sleep 0.1; done
[ -S "$socket" ] || fail "munged does not start"
slurmctld -D 2> /dev/null &
daemons=($! "${daemons[@]}")
slurmd -D 2> /dev/null &
daemons=($! "${daemons[@]}")
for _ in $(seq 300); do sinfo --noheader --format=%T 2> /dev/null | grep -q idle && ready=1 && break; sleep 0.1; done
[ -n "${ready:-}" ] || fail "the node does not become idle"

grid=$work/grid.toml
cat > "$grid" <<GRID
scenes = ["cornell"]
size = ["48x32"]
frames = 3
truth_samples = 8
[[sweep]]
technique = "hierarchical"
[sweep.grid]
start_resolution = ["half", "quarter"]
levels = [1, 2, 3, 4]
samples = [4, 8, 16, 32, 64]
GRID
cd "$work"
export HALFLIGHT_CACHE=$work/cache
wait_for() {
    # A job is gone from the queue some time after its end.
    for _ in $(seq 3000); do
        states=$(squeue --noheader --jobs="$1" --states=all --format=%T 2> /dev/null || true)
        echo "$states" | grep -qE 'PENDING|RUNNING|COMPLETING|REQUEUED|CONFIGURING|SUSPENDED' || return 0
        sleep 0.2
    done
    fail "job $1 does not end"
}
cells() { if [ -f "$1/cells.jsonl" ]; then wc -l < "$1/cells.jsonl"; else echo 0; fi; }

say "an array of 4, and the merge behind it"
folder=$work/out
read -r array merge < <("$here/submit.sh" "$grid" "$folder" 4)
victim=1
for _ in $(seq 3000); do [ "$(cells "$folder/part-$victim")" -ge 2 ] && break; sleep 0.05; done
job=$(squeue --noheader --jobs="${array}_$victim" --format=%A)
pid=$(scontrol listpids "$job" 2> /dev/null | while read -r pid _; do
    [ "$(cat "/proc/$pid/comm" 2> /dev/null)" = "$(basename "$EVALUATOR")" ] && echo "$pid"; done | head -n 1)
[ -n "$pid" ] || fail "task $victim has no process"
kill -KILL "$pid"
at_kill=$(cells "$folder/part-$victim")
say "task $victim was killed after $at_kill cells"
wait_for "$array"
restarts=$(scontrol show job "${array}_$victim" | grep -o 'Restarts=[0-9]*' | head -n 1)
[ "$restarts" = "Restarts=1" ] || fail "task $victim was not started again: $restarts"
wait_for "$merge"
grep -q "40 of 40 cells from 4 folders" "$folder/merge.log" || fail "the dependent merge lacks cells"
[ "$(cells "$folder/part-$victim")" -gt "$at_kill" ] || fail "the task that was killed was over already"
say "parts: $(for part in 0 1 2 3; do cells "$folder/part-$part"; done | xargs)"

say "the folder of part 2 is lost"
lost=$(cells "$folder/part-2")
rm -r "$folder/part-2" "$folder/report"
merge=$(sbatch --parsable --output="$folder/merge-lost.log" "$here/merge.sbatch" "$folder")
wait_for "$merge"
grep -q "$lost of 40 cells are missing" "$folder/merge-lost.log" || fail "the merge does not count what is missing"
again=$(sbatch --parsable --array=0-1 --output="$folder/again-%a.log" "$here/cells.sbatch" \
    "$folder/report/missing.toml" "$folder/part-again")
wait_for "$again"
mv "$folder/part-again/part-0" "$folder/part-again-0"
mv "$folder/part-again/part-1" "$folder/part-again-1"
rmdir "$folder/part-again"
merge=$(sbatch --parsable --output="$folder/merge-again.log" "$here/merge.sbatch" "$folder")
wait_for "$merge"
grep -q "40 of 40 cells from 5 folders" "$folder/merge-again.log" || fail "the second merge lacks cells"

say "a single run, from a cache of its own"
HALFLIGHT_CACHE=$work/other-cache "$EVALUATOR" run --grid "$grid" --out "$work/single" 2> "$work/log/single" \
    || fail "the single run fails"
count() { find "$1/images" -type f | wc -l; }
[ "$(count "$work/single")" = "$(count "$folder/report")" ] || fail "the reports have different pictures"
for picture in "$work"/single/images/*.png; do
    cmp -s "$picture" "$folder/report/images/$(basename "$picture")" || fail "$(basename "$picture") differs"
done
# A merge refuses a cell that two folders have with different results, and compares the values of EXR files.
"$EVALUATOR" merge "$work/single" "$folder/report" --out "$work/both" --complete 2> "$work/log/both" \
    || fail "the merged report differs from that of a single run"
# That it would have: one error is changed in its last but one digit.
cp -r "$folder/report" "$work/changed"
perl -pi -e 'if ($. == 7) { s/("indirect_rmse":[0-9.]*)([0-9])([0-9])(?=[,}e])/$1 . (($2 + 1) % 10) . $3/e }' \
    "$work/changed/cells.jsonl"
if "$EVALUATOR" merge "$work/single" "$work/changed" --out "$work/wrong" 2> "$work/log/changed"; then
    fail "a changed error is not noticed"
fi
grep -q '`indirect_rmse`' "$work/log/changed" || fail "the refusal does not name the column"
say "the merged report equals that of a single run"
