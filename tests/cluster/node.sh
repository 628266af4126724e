# A SLURM cluster of one node, on loopback: `slurm_up FOLDER` starts it, `slurm_down` ends what was started.
# Sourced by run.sh. Needs root, and SLURM's and munge's programs.
slurm_folder=""

# Packages are installed, where Debian's can be; says what is missing and fails where they cannot.
slurm_install() {
    if command -v slurmctld >/dev/null && command -v munged >/dev/null; then
        return 0
    fi
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "needs slurmctld and munged, or root and apt-get to install slurm-wlm and munge" >&2
        return 1
    fi
    # A package's own services would start before they are set up.
    export DEBIAN_FRONTEND=noninteractive RUNLEVEL=1
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends slurm-wlm munge; } >/dev/null 2>&1 || {
        echo "apt-get could not install slurm-wlm and munge" >&2
        return 1
    }
}

slurm_up() {
    if [ -e /etc/slurm/slurm.conf ]; then
        echo "/etc/slurm/slurm.conf is there: this machine has a SLURM of its own, which is left alone" >&2
        return 1
    fi
    slurm_folder=$1
    mkdir -p "$slurm_folder/state" "$slurm_folder/spool"
    slurm_configuration >/etc/slurm/slurm.conf
    if ! munge -n >/dev/null 2>&1; then
        mkdir -p /run/munge
        chown munge: /run/munge
        runuser -u munge -- /usr/sbin/munged --pid-file=/run/munge/hobble.pid
    fi
    slurmctld -c
    slurmd
    local tries
    for tries in $(seq 100); do
        if [ "$(sinfo -h -o %T 2>/dev/null)" = idle ]; then return 0; fi
        sleep 0.2
    done
    echo "the node does not become idle:" >&2
    tail -n 20 "$slurm_folder"/*.log >&2
    return 1
}

# Jobs die when they use more memory than they asked for, or longer: what the rules state is put to the test.
slurm_configuration() {
    local name memory
    name=$(hostname -s)
    memory=$(awk '/^MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
    cat <<CONF
ClusterName=hobble
SlurmctldHost=$name(127.0.0.1)
SlurmctldAddr=127.0.0.1
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=root
SlurmctldPidFile=$slurm_folder/slurmctld.pid
SlurmdPidFile=$slurm_folder/slurmd.pid
StateSaveLocation=$slurm_folder/state
SlurmdSpoolDir=$slurm_folder/spool
SlurmctldLogFile=$slurm_folder/slurmctld.log
SlurmdLogFile=$slurm_folder/slurmd.log
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
OverTimeLimit=0
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=0
NodeName=$name NodeAddr=127.0.0.1 CPUs=2 Boards=1 SocketsPerBoard=1 CoresPerSocket=2 ThreadsPerCore=1 RealMemory=$memory State=UNKNOWN
PartitionName=all Nodes=$name Default=YES MaxTime=INFINITE State=UP
CONF
}

slurm_down() {
    [ -n "$slurm_folder" ] || return 0
    local file process tries
    # Jobs end before the daemon that would end them does.
    scancel --signal=KILL --full --user="$(id -un)" >/dev/null 2>&1
    scancel --user="$(id -un)" >/dev/null 2>&1
    for tries in $(seq 100); do
        [ -n "$(squeue -h 2>/dev/null)" ] || break
        sleep 0.2
    done
    for file in "$slurm_folder/slurmd.pid" "$slurm_folder/slurmctld.pid" /run/munge/hobble.pid; do
        process=$(cat "$file" 2>/dev/null) || continue
        kill "$process" 2>/dev/null
        for tries in $(seq 50); do
            kill -0 "$process" 2>/dev/null || break
            sleep 0.1
        done
    done
    rm -f /etc/slurm/slurm.conf
    slurm_folder=""
}
