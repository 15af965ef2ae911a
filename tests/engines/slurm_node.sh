#!/bin/sh
# A real Slurm of one node for a test: controller, compute daemon and munge,
# all on loopback, everything they write in one folder, without systemd.
#
#   slurm_node.sh start [--install] [--min-job-age SECONDS] DIR
#   slurm_node.sh stop DIR
#
# start   makes DIR (new or empty, or left by an earlier start), starts the
#         daemons, waits until the node takes jobs and prints on standard output
#         what a shell has to export (nothing else is printed there). Two nodes
#         in two folders do not disturb each other: each has its own ports, key
#         and socket.
# stop    ends the daemons and kills every process of their jobs. DIR stays (its
#         log folder tells what happened); stopping what does not run is no
#         error. The next start in DIR begins anew, with job number 1.
#
# --install            gets the Debian packages first, when they are missing
# --min-job-age S      how long the controller remembers a finished job
#                      (default 300 as in Slurm; with 2 the record is gone
#                      after some 10 s)
#
# Exit codes: 0 done; 1 the node did not come up (logs on standard error);
# 2 wrong usage; 77 not possible here, with a line "skipped: ..." on standard
# error.
set -eu

packages='slurm-wlm munge'
# The Debian packages put the daemons into sbin, which is not on the PATH of
# every caller.
PATH=${PATH:-/usr/bin:/bin}:/usr/local/sbin:/usr/sbin:/sbin
export PATH
# Messages and numbers are parsed below.
LC_ALL=C
export LC_ALL

usage() {
    echo "usage: slurm_node.sh start [--install] [--min-job-age SECONDS] DIR" >&2
    echo "       slurm_node.sh stop DIR" >&2
    exit 2
}

skip() {
    echo "skipped: $*" >&2
    exit 77
}

fail() {
    echo "slurm_node.sh: $*" >&2
    exit 1
}

# --- what has to be there ---------------------------------------------------

missing_program() {
    for program in munge munged slurmctld slurmd sbatch squeue scancel scontrol sinfo; do
        command -v "$program" >/dev/null 2>&1 || { echo "$program"; return 0; }
    done
    return 1
}

install_packages() {
    command -v apt-get >/dev/null 2>&1 || skip "no apt-get to install $packages"
    # The packages start daemons of their own, unless a policy says no; one
    # that is there already is left alone.
    policy=/usr/sbin/policy-rc.d
    if [ -e $policy ]; then
        policy=
    else
        trap 'rm -f "$policy"' EXIT
        printf '#!/bin/sh\nexit 101\n' >$policy
        chmod +x $policy
    fi
    # Recommended packages only bring plugins that this node does not use.
    # Nothing may reach standard output, which is for the environment.
    DEBIAN_FRONTEND=noninteractive
    export DEBIAN_FRONTEND
    # shellcheck disable=SC2086 # a list
    if ! apt-get update -qq >/dev/null </dev/null ||
        ! apt-get install -y -qq --no-install-recommends $packages >/dev/null </dev/null; then
        skip "apt-get could not install $packages"
    fi
    [ -z "$policy" ] || rm -f "$policy"
    trap - EXIT
}

require_programs() {
    if missing_program >/dev/null && [ "$install" = yes ]; then
        install_packages
    fi
    if program=$(missing_program); then
        skip "$program not found (Debian: apt-get install $packages)"
    fi
}

# --- ports ------------------------------------------------------------------

# Ports on which something listens, or which a connection still holds. /proc is
# read because neither ss nor netstat has to be installed.
used_ports() {
    cat /proc/net/tcp /proc/net/tcp6 2>/dev/null |
        sed -n 's/^ *[0-9]*: [0-9A-F]*:\([0-9A-F]\{4\}\) .*/\1/p'
}

# Two neighbouring free ports, from a random place below the range that the
# kernel gives to outgoing connections. Between here and the daemon's bind
# somebody else can take one; start_node then tries again with others.
free_port_pair() {
    used=$(used_ports)
    seed=$(od -An -N2 -tu2 /dev/urandom | tr -d ' ')
    port=$((20000 + seed % 6000 * 2))
    tries=0
    while [ $tries -lt 1000 ]; do
        first=$(printf '%04X' "$port")
        second=$(printf '%04X' $((port + 1)))
        case $used in
        *"$first"* | *"$second"*) ;;
        *) echo "$port"; return 0 ;;
        esac
        port=$((port + 2))
        tries=$((tries + 1))
    done
    return 1
}

# --- configuration ----------------------------------------------------------

# A node starts without a past: its controller would refuse the saved state of
# a cluster with another name. Only a folder that this script has made is
# emptied.
empty_folder() {
    if [ -s "$dir/run/cluster" ]; then
        rm -rf "$dir/log" "$dir/state" "$dir/spool" "$dir/run" "$dir/munge" \
            "$dir/slurm.conf" "$dir/cgroup.conf"
    elif [ -n "$(ls -A "$dir")" ]; then
        fail "$dir is neither empty nor the folder of a node"
    fi
}

make_folders() {
    mkdir -p "$dir/log" "$dir/state" "$dir/spool" "$dir/run" "$dir/munge"
    # munged wants to see that nobody else can write where its key and socket
    # are, and that everybody can reach the socket.
    chmod 0755 "$dir/munge" "$dir/state" "$dir/spool"
    if [ ! -s "$dir/munge/key" ]; then
        (umask 077 && dd if=/dev/urandom of="$dir/munge/key" bs=1024 count=1 2>/dev/null)
    fi
    chmod 0400 "$dir/munge/key"
}

write_configuration() {
    # The name of the cluster is in the environment of every job: stop_node
    # finds by it what a job has left behind. It is therefore unique.
    cluster=node$$x$port
    echo "$cluster" >"$dir/run/cluster"
    cat >"$dir/slurm.conf" <<END
ClusterName=$cluster
SlurmctldHost=localhost(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket
CredType=cred/munge
# Loopback only.
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmctldPort=$port
SlurmdPort=$((port + 1))
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/run/slurmctld.pid
SlurmdPidFile=$dir/run/slurmd.pid
SlurmctldLogFile=$dir/log/slurmctld.log
SlurmdLogFile=$dir/log/slurmd.log
# Neither control groups nor accounting: a container offers neither.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
MailProg=/bin/true
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
# A machine with one processor still is a node with two.
SlurmdParameters=config_overrides
ReturnToService=2
# Everything that is made to wait on a large machine happens at once here.
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
# Without an epilog the end of a job does not wake the scheduler, and the next
# one waits for its tick of a second: 20 short tasks take 10 s instead of 1 s.
Epilog=/bin/true
KillWait=1
MinJobAge=$min_job_age
MaxArraySize=1001
MaxJobCount=10000
NodeName=localhost NodeAddr=127.0.0.1 CPUs=2 RealMemory=1024 State=UNKNOWN
PartitionName=test Nodes=localhost Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
END
    write_cgroup_configuration
}

# Newer versions look for control groups even when no plugin uses them, and
# can be told not to; older ones do not know the word and need no file.
write_cgroup_configuration() {
    : >"$dir/cgroup.conf"
    version=$(slurmctld -V | sed -n 's/^[^0-9]*\([0-9]*\)\..*/\1/p')
    if [ "${version:-0}" -ge 24 ]; then
        echo 'CgroupPlugin=disabled' >"$dir/cgroup.conf"
    elif [ "${version:-0}" -ge 23 ]; then
        echo 'IgnoreSystemd=yes' >"$dir/cgroup.conf"
    fi
}

# --- processes --------------------------------------------------------------

# launch NAME COMMAND...: in a session of its own (no signal of the caller's
# terminal reaches it), with a clean environment (the caller may itself be a
# job), and holding none of the caller's pipes open.
launch() {
    name=$1
    shift
    setsid env -i PATH="$PATH" LC_ALL=C SLURM_CONF="$dir/slurm.conf" "$@" \
        </dev/null >>"$dir/log/$name.out" 2>&1 &
    echo $! >"$dir/run/$name.pid_started"
    # Until the new process is the daemon, it looks as if there were none.
    wait_for 2 pid_of "$name" || true
}

# The process that launch has started, if it still lives and still is that
# one: numbers are used again.
pid_of() {
    [ -s "$dir/run/$1.pid_started" ] || return 1
    pid=$(cat "$dir/run/$1.pid_started")
    grep -qaF "$dir/" "/proc/$pid/cmdline" 2>/dev/null || return 1
    echo "$pid"
}

# Numbers of the processes that this node has left behind: those of its jobs,
# which carry the cluster's name, their shepherds (slurmstepd), for which slurmd
# does not wait when it ends, and helpers of the controller. Only a process that
# has both left its job's process tree and cleared its environment is not found.
left_pids() {
    [ -s "$dir/run/cluster" ] || return 0
    processes_with "SLURM_CLUSTER_NAME=$(cat "$dir/run/cluster")"
    for pid in $(processes_with "SLURM_CONF=$dir/slurm.conf"); do
        # A caller which has exported SLURM_CONF must not be taken for one.
        case $(readlink "/proc/$pid/exe" 2>/dev/null) in
        */slurmstepd* | */slurmd* | */slurmctld*) echo "$pid" ;;
        esac
    done
}

# processes_with NAME=VALUE: numbers of the processes with exactly that in the
# environment with which they were started.
processes_with() {
    grep -lzxF -e "$1" /proc/[0-9]*/environ 2>/dev/null | sed 's,^/proc/,,; s,/.*,,' || true
}

# wait_for SECONDS COMMAND...: true as soon as COMMAND is.
wait_for() {
    rounds=$(($1 * 20))
    shift
    while ! "$@" >/dev/null 2>&1; do
        rounds=$((rounds - 1))
        [ $rounds -gt 0 ] || return 1
        sleep 0.05
    done
}

# wait_for_daemon SECONDS NAME COMMAND: the same, but gives up at once when the
# daemon is gone.
wait_for_daemon() {
    daemon=$2
    condition=$3
    wait_for "$1" daemon_settled || return 1
    $condition >/dev/null 2>&1
}

daemon_settled() {
    $condition || ! pid_of "$daemon"
}

munge_answers() {
    munge --no-input --socket="$dir/munge/socket"
}

controller_answers() {
    scontrol ping | grep -q 'is UP'
}

node_takes_jobs() {
    [ "$(sinfo -h -n localhost -o %T)" = idle ]
}

# --- start ------------------------------------------------------------------

start_munge() {
    # --force: the folder may lie below one that a group can write, which
    # munged would refuse; the key is made for this test alone.
    launch munged munged --foreground --force \
        --key-file="$dir/munge/key" --socket="$dir/munge/socket" \
        --pid-file="$dir/run/munged.pid" --log-file="$dir/log/munged.log" \
        --seed-file="$dir/munge/seed" --num-threads=2
    wait_for_daemon 10 munged munge_answers
}

start_slurm() {
    launch slurmctld slurmctld -D -f "$dir/slurm.conf"
    wait_for_daemon 10 slurmctld controller_answers || return 1
    launch slurmd slurmd -D -N localhost -f "$dir/slurm.conf"
    wait_for_daemon 15 slurmd node_takes_jobs
}

show_logs() {
    # What a daemon prints holds its log as well.
    for file in "$dir"/log/*.out; do
        [ -s "$file" ] || continue
        echo "--- $file"
        tail -n 20 "$file"
    done >&2
}

start_node() {
    [ "$(id -u)" = 0 ] || skip "starting Slurm needs root"
    require_programs
    mkdir -p "$dir"
    dir=$(cd "$dir" && pwd -P)
    # A socket's path has room for 108 characters; slurmstepd appends to ours.
    [ ${#dir} -le 70 ] || fail "the path of $dir is too long for sockets: use a shorter one"
    case $dir in
    *[!A-Za-z0-9_./+-]*) fail "slurm.conf cannot name $dir: use a path of letters, digits and _ . + -" ;;
    esac
    if pid_of slurmctld >/dev/null || pid_of munged >/dev/null; then
        fail "a node already runs in $dir"
    fi
    SLURM_CONF=$dir/slurm.conf
    export SLURM_CONF
    empty_folder
    trap 'stop_processes; exit 130' INT TERM
    attempt=1
    while :; do
        make_folders
        port=$(free_port_pair) || fail "no two free ports"
        write_configuration
        if start_munge && start_slurm; then
            break
        fi
        stop_processes
        if [ $attempt -ge 3 ]; then
            show_logs
            fail "the node did not come up"
        fi
        attempt=$((attempt + 1))
        empty_folder
    done
    echo "export SLURM_CONF=$SLURM_CONF"
}

# --- stop -------------------------------------------------------------------

nothing_of() {
    ! pid_of "$1"
}

# end_daemon NAME SIGNAL
end_daemon() {
    pid=$(pid_of "$1") || return 0
    kill "-$2" "$pid" 2>/dev/null || true
    wait_for 5 nothing_of "$1" && return 0
    kill -KILL "$pid" 2>/dev/null || true
    wait_for 5 nothing_of "$1"
}

nothing_left() {
    [ -z "$(left_pids)" ]
}

kill_what_is_left() {
    # Several rounds: a process may start another while the list is made.
    rounds=0
    while ! nothing_left && [ $rounds -lt 40 ]; do
        for pid in $(left_pids); do
            kill -KILL "$pid" 2>/dev/null || true
        done
        rounds=$((rounds + 1))
        sleep 0.05
    done
}

stop_processes() {
    # The compute daemon first, so that nothing new starts; without asking,
    # since it would wait for its jobs.
    end_daemon slurmd KILL
    end_daemon slurmctld TERM
    end_daemon munged TERM
    kill_what_is_left
    rm -f "$dir"/run/*.pid_started
}

stop_node() {
    [ -d "$dir" ] || return 0
    dir=$(cd "$dir" && pwd -P)
    [ -d "$dir/run" ] || return 0
    stop_processes
    nothing_left || fail "processes are left: $(left_pids | tr '\n' ' ')"
}

# --- command line -----------------------------------------------------------

[ $# -ge 1 ] || usage
verb=$1
shift
install=no
min_job_age=300
dir=
while [ $# -gt 0 ]; do
    case $1 in
    --install) install=yes ;;
    --min-job-age)
        [ $# -ge 2 ] || usage
        shift
        min_job_age=$1
        case $min_job_age in
        '' | *[!0-9]*) usage ;;
        esac
        ;;
    -*) usage ;;
    *)
        [ -z "$dir" ] || usage
        dir=$1
        ;;
    esac
    shift
done
[ -n "$dir" ] || usage
case $verb in
start) start_node ;;
stop) stop_node ;;
*) usage ;;
esac
