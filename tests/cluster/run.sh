#!/usr/bin/env bash
# The `test` configuration through a real SLURM of one node; snakemake and two jobs are killed on the way: tests/cluster/run.sh
# Installs slurm-wlm and munge where they are missing (root, apt-get), and the extra `cluster` beside the environment;
# starts the daemons on loopback; ends all that it started. Status 0: the results are those of a local run, bit for bit.
# Status 77: it cannot be tried on this machine, and why.
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
here=$root/tests/cluster
python=${HOBBLE_PYTHON:-$root/.venv/bin/python}
target=results/test/report.html
. "$here/node.sh"

folder=$(mktemp -d "${TMPDIR:-/tmp}/hobble-cluster.XXXXXX")
log=$folder/cluster.log
running=()

finish() {
    local status=$? process
    for process in "${running[@]}"; do kill -KILL -- "-$process" 2>/dev/null; done
    slurm_down
    # What a killed job had started outlives it: SLURM tracks processes here, it does not contain them.
    for process in $(grep -las "$folder/" /proc/[0-9]*/cmdline | cut -d/ -f3); do
        [ "$process" = $$ ] || kill -KILL "$process" 2>/dev/null
    done
    if [ "$status" = 0 ] || [ "$status" = 77 ]; then
        rm -rf "$folder"
    else
        echo "what it left: $folder" >&2
    fi
    exit "$status"
}
trap finish EXIT
trap 'exit 130' INT TERM

say() { echo "cluster: $*"; }
fail() {
    say "$*" >&2
    tail -n 40 "$log" >&2
    exit 1
}

# SLURM kills what runs: waits until a job whose comment holds $1 has written the log $2.
kill_job() {
    local job deadline=$((SECONDS + 900))
    until compgen -G "$folder/cluster/$2" >/dev/null; do
        kill -0 "$cluster" 2>/dev/null || fail "it ended before a job of $1 could be killed"
        [ $SECONDS -lt $deadline ] || fail "no job of $1 within a quarter of an hour"
        sleep 0.05
    done
    job=$(squeue -h -t R -o '%i %k' | awk -v of="$1" '$2 ~ of {print $1; exit}')
    [ -n "$job" ] && scancel --signal=KILL --full "$job" || fail "the job of $1 could not be killed"
    say "killed SLURM job $job ($1)"
}

# The same command as on a real cluster; only the polling is for one that has nothing else to do.
through_slurm=("$folder/venv/bin/python" -m snakemake -s "$root/Snakefile" -d "$folder/cluster"
    --workflow-profile "$root/profiles/slurm" --slurm-init-seconds-before-status-checks 2 "$target")

export OMP_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=1
mkdir "$folder/local" "$folder/cluster"
setsid "$python" -m snakemake -s "$root/Snakefile" -d "$folder/local" -c2 \
    "$target" >"$folder/local.log" 2>&1 &
local_run=$!
running+=("$local_run")

if ! slurm_install; then exit 77; fi
# Beside the environment, not in it: with the plugin in place every call of snakemake is slower.
"$python" -m venv "$folder/venv"
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
echo "import site; site.addsitedir('$site')" >"$("$folder/venv/bin/python" -c \
    'import sysconfig; print(sysconfig.get_path("purelib"))')/environment.pth"
"$folder/venv/bin/python" -m pip install -qq --disable-pip-version-check \
    --constraint "$root/constraints.txt" snakemake-executor-plugin-slurm || fail "the plugin cannot be installed"
slurm_up "$folder/node" || exit 77
say "SLURM $(slurmctld -V | awk '{print $2}') is up on one node, memory and time of jobs enforced"

# The machine where snakemake runs dies, and its jobs live on and write while the same command starts them again.
setsid "${through_slurm[@]}" >"$log" 2>&1 &
head=$!
running+=("$head")
until [ -n "$(squeue -h -t R -o '%k' | grep -E 'motion|terrain|labels')" ]; do
    kill -0 "$head" 2>/dev/null || fail "it ended before it could be killed"
    sleep 0.05
done
kill -KILL -- "-$head"
say "killed snakemake itself while $(squeue -h | wc -l) of its jobs run or wait"

setsid "${through_slurm[@]}" >"$log" 2>&1 &
cluster=$!
running+=("$cluster")
kill_job labels_clips 'results/datasets/tiny/logs/labels/labels_clips/*.log'
kill_job training 'results/test/logs/training/training.log'
wait "$cluster"
[ -e "$folder/cluster/$target" ] || fail "the run through SLURM failed"

restarts=$(grep -c 'Trying to restart' "$log")
submitted=$(grep -c 'has been submitted with SLURM jobid' "$log")
say "$submitted jobs submitted, $restarts of them a second time"
# A third would be one that SLURM killed because it took more than its rule states.
[ "$restarts" = 2 ] || fail "two jobs were killed, but $restarts started again"

# By its last file, not by its status, which bash may have forgotten among thousands of processes since.
wait "$local_run"
[ -e "$folder/local/$target" ] || { tail -n 40 "$folder/local.log" >&2; fail "the local run failed"; }
(cd "$root" && "$python" -m tests.faults.same "$folder/local" "$folder/cluster") || fail "the results differ"
"${through_slurm[@]}" >"$log" 2>&1 && grep -q 'Nothing to be done' "$log" || fail "a second run had something to do"

# The same batches once more by two tasks, as on two machines: srun starts torchrun twice, on the one node there is.
weights=results/test/network/weights.npz
rm -r "$folder/cluster/results/test/checkpoints" "$folder/cluster/$weights"
two_tasks=("${through_slurm[@]:0:${#through_slurm[@]}-1}" --set-resources training:nodes=1 --set-threads training=1
    --config 'training={nodes: 2, stretches: 1}' -- "$weights")
"${two_tasks[@]}" >"$log" 2>&1 || fail "the training of two tasks failed"
"$python" "$here/near.py" "$folder/local/$weights" "$folder/cluster/$weights" || fail "two tasks learnt something else"
say "passed in $SECONDS s"
