#!/bin/sh
# A job of `lanecast batch` on HyperQueue: an array of shards, and one task that joins what they did.
#
#     hq server start & hq alloc add slurm --time-limit 1h        # once; or: hq worker start
#     docs/farm/hyperqueue.sh JOB OUT [SHARDS]
#
# OUT is a folder that all workers see. `hq job task-ids N --filter=failed` lists what failed.
set -eu
job=$1 out=$2 shards=${3:-16}
lanecast=${LANECAST:-lanecast}

hq submit --wait --array="0-$((shards - 1))" --cpus=all --name=lanecast -- \
    sh -c "exec '$lanecast' batch '$job' --out '$out' --shard \$HQ_TASK_ID/$shards --progress none"
"$lanecast" batch "$job" --out "$out" --merge
