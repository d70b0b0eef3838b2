#!/bin/sh
# A job of `lanecast batch` on Slurm: an array of shards, and one task after it that joins what they did.
#
#     docs/farm/slurm.sh JOB OUT [SHARDS [OPTIONS OF sbatch...]]
#
# OUT is a folder that all nodes see. Shards that end early (a limit of time, a node that fails) are
# queued again and go on where they were; Slurm tells them a minute before the limit.
set -eu
job=$1 out=$2 shards=${3:-16}
[ $# -gt 3 ] && shift 3 || shift $#
lanecast=${LANECAST:-lanecast}

array=$(sbatch --parsable --array="0-$((shards - 1))" --requeue --signal=B:TERM@60 "$@" <<EOF
#!/bin/sh
exec '$lanecast' batch '$job' --out '$out' --shard "\$SLURM_ARRAY_TASK_ID/$shards" --progress none
EOF
)
sbatch --parsable --dependency="afterany:$array" "$@" <<EOF
#!/bin/sh
exec '$lanecast' batch '$job' --out '$out' --merge
EOF
