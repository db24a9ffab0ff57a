#!/usr/bin/env bash
# A batch as a Slurm array.
#
#   sbatch slurm_array.sh TEST RECORDINGS OUT
#
# Each task of the array analyses one part. Then a job joins the parts, if none has failed.
#
# A part that has failed is run again alone, here part 5 of 16. Then the parts are joined by hand:
#
#   OF=16 sbatch --array=5 slurm_array.sh TEST RECORDINGS OUT
#   tapjoint batch RECORDINGS --test TEST --out OUT --merge
#
# Without Slurm this file runs PARTS parts (4) one after the other on this machine, and joins them.
#SBATCH --job-name=tapjoint
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --time=02:00:00
#SBATCH --requeue
set -euo pipefail

test="$1" recordings="$2" out="$3"
batch=(tapjoint batch "$recordings" --test "$test" --out "$out" --quiet)

# part I N: analyses part I of N.
part() {
    # Exit code 1: no test of the part has an answer. The tables will tell.
    "${batch[@]}" --shard "$1/$2" --jobs "${SLURM_CPUS_PER_TASK:-1}" || [ $? -eq 1 ]
}

if [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then
    parts="${PARTS:-4}"
    for ((i = 1; i <= parts; i++)); do
        part "$i" "$parts"
    done
    "${batch[@]}" --merge
elif [ -n "${OF:-}" ]; then
    part "$SLURM_ARRAY_TASK_ID" "$OF"
elif [ "$SLURM_ARRAY_TASK_MAX" -ne "$SLURM_ARRAY_TASK_COUNT" ]; then
    echo "slurm_array.sh: this array has not all parts from 1; give OF=N for some of N parts" >&2
    exit 2
else
    part "$SLURM_ARRAY_TASK_ID" "$SLURM_ARRAY_TASK_COUNT"
    # The first task asks for the job that joins the parts, after all of them.
    if [ "$SLURM_ARRAY_TASK_ID" -eq 1 ]; then
        sbatch --job-name=tapjoint-merge --dependency="afterok:$SLURM_ARRAY_JOB_ID" --kill-on-invalid-dep=yes \
            --wrap "$(printf '%q ' "${batch[@]}" --merge)"
    fi
fi
