#!/usr/bin/env bash
# A batch as a Slurm array.
#
#   sbatch slurm_array.sh TEST RECORDINGS OUT
#
# Each task of the array analyses one part. Then a job joins the parts, if none has failed. To run part 5 of 16 again:
#
#   PARTS=16 sbatch --array=5 slurm_array.sh TEST RECORDINGS OUT
#
# and then join the parts with --merge. Without Slurm this file runs PARTS parts one after the other, on the machine where it
# is called.
#SBATCH --job-name=tapjoint
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --time=02:00:00
#SBATCH --requeue
set -euo pipefail

test="$1" recordings="$2" out="$3"
parts="${PARTS:-${SLURM_ARRAY_TASK_COUNT:-4}}"
batch=(tapjoint batch "$recordings" --test "$test" --out "$out" --quiet)

part() {
    # Exit code 1: no test of the part has an answer. The tables will tell.
    "${batch[@]}" --shard "$1/$parts" --jobs "${SLURM_CPUS_PER_TASK:-1}" || [ $? -eq 1 ]
}

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    part "$SLURM_ARRAY_TASK_ID"
    # The first task asks for the job that joins the parts, after all of them.
    if [ "$SLURM_ARRAY_TASK_ID" -eq 1 ]; then
        sbatch --job-name=tapjoint-merge --dependency="afterok:$SLURM_ARRAY_JOB_ID" --wrap "$(printf '%q ' "${batch[@]}" --merge)"
    fi
else
    for ((i = 1; i <= parts; i++)); do
        part "$i"
    done
    "${batch[@]}" --merge
fi
