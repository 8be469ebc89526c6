#!/usr/bin/env bash
# A study as a Slurm job array gives the rows of a local one: brings up a real Slurm of one machine
# (slurmctld, slurmd, munge) in a folder of its own, on the loopback, and takes it down again.
#
#   tests/slurm.sh             needs root, for slurmd; installs Debian's slurm-wlm and munge if missing
#   METROTWIN=path tests/slurm.sh      with a program that is built already
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ $(id -u) -ne 0 ]]; then
    echo "tests/slurm.sh: slurmd starts jobs as their users and must be root: run it with sudo" >&2
    exit 1
fi
if ! command -v slurmctld slurmd munged sbatch >/dev/null; then
    if ! command -v apt-get >/dev/null; then
        echo "tests/slurm.sh: install Slurm (slurmctld, slurmd, sbatch) and munge" >&2
        exit 1
    fi
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends slurm-wlm munge >/dev/null
fi

. tests/common/scripts.sh
find_program

dir=$(mktemp -d)
pids=()
stop() {
    status=$?
    if [[ $status -ne 0 ]]; then
        tail -n 40 "$dir"/*.log "$dir"/array/slurm/*.log >&2 2>/dev/null || true
    fi
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$dir"
    exit $status
}
trap stop EXIT

# Its own key and socket: nothing of a Slurm that may run here is touched.
mkdir -p "$dir"/{munge,state,spool}
dd if=/dev/urandom of="$dir/munge/key" bs=1024 count=1 status=none
chmod 700 "$dir/munge" && chmod 600 "$dir/munge/key" && chmod 755 "$dir"
# All users of jobs must reach the socket, and only root may write beside it.
mkdir -m 755 "$dir/run"
munged --force --foreground --num-threads 1 --socket "$dir/run/munge.socket" \
    --key-file "$dir/munge/key" --pid-file "$dir/run/munged.pid" --seed-file "$dir/munge/seed" \
    --log-file "$dir/munged.log" &
pids+=($!)

host=$(hostname -s)
cores=$(nproc)
cat >"$dir/slurm.conf" <<CONF
ClusterName=metrotwin-test
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$dir/run/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=26817
SlurmdPort=26818
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/run/slurmctld.pid
SlurmdPidFile=$dir/run/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SchedulerParameters=sched_interval=1,bf_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$dir/slurm.conf
slurmctld -D >"$dir/slurmctld.log" 2>&1 &
pids+=($!)
slurmd -D -N "$host" >"$dir/slurmd.log" 2>&1 &
pids+=($!)
for _ in $(seq 60); do
    [[ $(sinfo -h -o %T 2>/dev/null) == idle ]] && break
    sleep 0.5
done
sinfo -h -o "Slurm %v: %n is %T, %c CPUs" || { echo "Slurm did not come up" >&2; exit 1; }

study=tests/studies/small.toml
"$METROTWIN" study run "$study" --out "$dir/local" --renderer cpu >/dev/null
timeout 300 "$METROTWIN" study submit "$study" --shards 3 --out "$dir/array" --renderer cpu --wait
"$METROTWIN" study compare "$dir/local" "$dir/array" --same
echo "1 passed, 0 failed"
