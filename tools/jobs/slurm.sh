#!/bin/bash
#SBATCH --job-name=stylet
#SBATCH --array=0-15
#SBATCH --cpus-per-task=2
#SBATCH --mem=4G
#SBATCH --time=12:00:00
#SBATCH --output=stylet-%A_%a.log
# A data set by a Slurm array: each task draws its share of the frames into one folder that all see. A task that was
# killed goes on where it stopped when the same job is submitted again.
#   sbatch tools/jobs/slurm.sh SCENARIO FRAMES SEED FOLDER [OPTION of stylet render...]
set -euo pipefail
if [ $# -lt 4 ]; then
  echo "slurm.sh: give SCENARIO FRAMES SEED FOLDER, such as liver_biopsy 10000 1 /scratch/liver" >&2
  exit 2
fi
scenario=$1 frames=$2 seed=$3 folder=$4
shift 4
exec stylet render "$scenario" --ultrasound --random "$frames" --seed "$seed" --out "$folder" \
  --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" "$@"
