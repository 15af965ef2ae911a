//! Memory that a scene will take, compared with what there is before any of it is taken: a failed
//! allocation would end the program without a word.

use crate::deck::{self, Deck, Diagnostic, StageBody, Strength};
use beamsim_core::probe::LargestRow;
use std::fs;
use std::path::Path;

/// Bytes that a node takes in a static run, by the order of its element, measured on chains of
/// 50,000 to 200,000 elements.
const NODE_BYTES: [f64; 3] = [1500.0, 2000.0, 2500.0];

/// Additional bytes that a node takes in a dynamic stage, measured likewise.
const NODE_BYTES_IN_DYNAMICS: f64 = 200.0;

/// Additional bytes that a node takes in a modal stage, measured likewise.
const NODE_BYTES_IN_MODES: f64 = 10_000.0;

/// Additional bytes that a node takes for each mode that is asked for, measured likewise.
const NODE_BYTES_OF_A_MODE: f64 = 320.0;

/// Additional bytes that a node takes for each largest value that is followed there: rows that wait.
const NODE_BYTES_IN_ENVELOPE: f64 = LargestRow::WAITING_BYTES as f64;

/// The part of a limited address space that data can fill: allocators and threads reserve the rest.
const USABLE_SHARE: f64 = 0.85;

/// Scenes of fewer bytes fit every machine: what there is, is not looked up.
const SMALL: f64 = 64e6;

/// Refuses a scene for which there is not enough memory. The diagnostic stands at the beam with the
/// most nodes.
pub fn check(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let MemoryNeed { bytes, nodes } = need(deck);
    // More nodes than are supported are refused on every machine.
    if bytes < SMALL || nodes > deck::MOST_ELEMENTS as f64 {
        return;
    }
    let Some(room) = room().filter(|room| bytes > room.bytes) else { return };
    let Some(largest) = deck.beams.iter().max_by(|a, b| nodes_of(a).total_cmp(&nodes_of(b))) else { return };
    let message = format!(
        "about {} of memory are needed for {nodes:.0} nodes, but only {} are free ({})",
        size(bytes),
        size(room.bytes),
        room.bound
    );
    let fitting = fitting(nodes * room.bytes / bytes);
    let or_less = if deck.output.envelope.is_some() { ", or leave out `envelope`" } else { "" };
    let help = format!("about {fitting:.0} nodes would fit: take fewer `elements`{or_less}");
    diagnostics.push(Diagnostic::limit(message, largest.elements.span.clone()).help(help));
}

/// A number of nodes with two digits, rounded down.
fn fitting(nodes: f64) -> f64 {
    let unit = 10_f64.powi(nodes.max(1.0).log10().floor() as i32 - 1).max(1.0);
    (nodes / unit).floor() * unit
}

fn size(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

/// Memory that a scene takes.
struct MemoryNeed {
    bytes: f64,
    nodes: f64,
}

fn need(deck: &Deck) -> MemoryNeed {
    let of_stage = |stage: &deck::Stage| match stage.body {
        StageBody::Static { .. } | StageBody::Path { .. } => 0.0,
        StageBody::Dynamic { .. } => NODE_BYTES_IN_DYNAMICS,
        StageBody::Modal { modes } => NODE_BYTES_IN_MODES + NODE_BYTES_OF_A_MODE * modes as f64,
        StageBody::Buckling { modes } => NODE_BYTES_OF_A_MODE * modes as f64,
    };
    let of_stages = deck.stages.iter().map(of_stage).fold(0.0, f64::max);
    let of_envelope = NODE_BYTES_IN_ENVELOPE * followed(deck) as f64;
    let mut need = MemoryNeed { bytes: 0.0, nodes: 0.0 };
    for beam in &deck.beams {
        let nodes = nodes_of(beam);
        need.nodes += nodes;
        need.bytes += nodes * (NODE_BYTES[beam.order.clamp(1, 3) - 1] + of_stages + of_envelope);
    }
    need
}

/// The number of largest values that an envelope follows at a place, at most: von Mises stress, and a
/// failure index that is not von Mises stress over a strength.
fn followed(deck: &Deck) -> usize {
    if deck.output.envelope.is_none() {
        return 0;
    }
    let has_own_index = |material: &deck::Material| match &material.strength {
        Some(Strength::Ply { .. }) => true,
        Some(Strength::Yield(_)) => material.strain_limit.is_some() || deck.materials.len() > 1,
        None => material.strain_limit.is_some(),
    };
    1 + usize::from(deck.materials.iter().any(has_own_index))
}

/// The number of nodes of a beam; a number that no integer holds is possible here.
fn nodes_of(beam: &deck::Beam) -> f64 {
    let elements: f64 = match &beam.elements.value[..] {
        [division] => division.count() as f64 * beam.pieces() as f64,
        divisions => divisions.iter().map(|division| division.count() as f64).sum(),
    };
    elements * beam.order as f64
}

/// Memory that can still be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Room {
    bytes: f64,
    /// What sets the bound
    bound: &'static str,
}

/// The least of all bounds; `None` where the system does not tell any.
fn room() -> Option<Room> {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let process = |name: &str| read(&Path::new("/proc/self").join(name)).unwrap_or_default();
    let machine = machine_room(&fs::read_to_string("/proc/meminfo").unwrap_or_default());
    let own = process_room(&process("limits"), &process("status"));
    let group = group_room(&process("cgroup"), &read);
    [machine, own, group].into_iter().flatten().min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// The number of bytes in a line such as `MemAvailable:   23185988 kB`.
fn kilobytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    line.split_whitespace().next()?.parse::<f64>().ok().map(|number| 1024.0 * number)
}

/// Free memory of the machine, from /proc/meminfo.
fn machine_room(meminfo: &str) -> Option<Room> {
    let bytes = kilobytes(meminfo, "MemAvailable")? + kilobytes(meminfo, "SwapFree").unwrap_or(0.0);
    Some(Room { bytes, bound: "memory of this machine" })
}

/// What the limits of the process leave, from /proc/self/limits and /proc/self/status.
fn process_room(limits: &str, status: &str) -> Option<Room> {
    let bounds = [
        ("Max address space", "VmSize", "limit of the address space, `ulimit -v`"),
        ("Max data size", "VmData", "limit of the data size, `ulimit -d`"),
    ];
    let left = |(limit, used, bound): (&str, &str, &'static str)| {
        let line = limits.lines().find_map(|line| line.strip_prefix(limit))?;
        let limit: f64 = line.split_whitespace().next()?.parse().ok()?;
        let bytes = USABLE_SHARE * (limit - kilobytes(status, used)?).max(0.0);
        Some(Room { bytes, bound })
    };
    bounds.into_iter().filter_map(left).min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// What the control groups of the process leave, from /proc/self/cgroup and the files that it leads
/// to. `read` gives the text of a file.
fn group_room(groups: &str, read: &dyn Fn(&Path) -> Option<String>) -> Option<Room> {
    let number = |path: &Path| read(path)?.trim().parse::<f64>().ok();
    let mut least: Option<f64> = None;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(own)) = (parts.next(), parts.next()) else { continue };
        let version = if controllers.is_empty() {
            GROUPS_2
        } else if controllers.split(',').any(|name| name == "memory") {
            GROUPS_1
        } else {
            continue;
        };
        // A group has at most what the groups around it have. In a container the own path may not
        // exist, but its root does.
        for group in Path::new(own.trim_start_matches('/')).ancestors() {
            let folder = Path::new(version.root).join(group);
            let Some(limit) = number(&folder.join(version.limit)) else { continue };
            let Some(used) = number(&folder.join(version.used)) else { continue };
            let statistics = read(&folder.join("memory.stat")).unwrap_or_default();
            let cached = statistics.lines().find_map(|line| line.strip_prefix(version.cached)?.trim().parse().ok());
            let bytes = (limit - used + cached.unwrap_or(0.0)).max(0.0);
            least = Some(least.map_or(bytes, |least| least.min(bytes)));
        }
    }
    least.map(|bytes| Room { bytes, bound: "memory limit of the control group" })
}

/// Names of the files of a version of control groups.
#[derive(Clone, Copy)]
struct GroupFiles {
    root: &'static str,
    limit: &'static str,
    used: &'static str,
    /// The statistic of file contents in memory that the system gives back when it needs room
    cached: &'static str,
}

const GROUPS_1: GroupFiles = GroupFiles {
    root: "/sys/fs/cgroup/memory",
    limit: "memory.limit_in_bytes",
    used: "memory.usage_in_bytes",
    cached: "total_inactive_file ",
};

const GROUPS_2: GroupFiles =
    GroupFiles { root: "/sys/fs/cgroup", limit: "memory.max", used: "memory.current", cached: "inactive_file " };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_read_where_the_system_tells_them() {
        let machine = machine_room("MemTotal:  100 kB\nMemAvailable:   50 kB\nSwapFree: 10 kB\n").unwrap();
        assert_eq!(machine.bytes, 60.0 * 1024.0);
        let limits = "Max data size             unlimited            unlimited            bytes\n\
                      Max address space         1024000              unlimited            bytes\n";
        let own = process_room(limits, "VmSize:\t  500 kB\nVmData: 7 kB\n").unwrap();
        assert_eq!(own.bytes, USABLE_SHARE * (1_024_000.0 - 512_000.0));
        assert_eq!(process_room(&limits.replace("1024000", "unlimited"), "VmSize: 1 kB\n"), None);
        assert_eq!(machine_room(""), None);
    }

    #[test]
    fn envelopes_need_room_for_rows_that_wait() {
        let deck = |material: &str, envelope: bool| {
            format!(
                "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[material.m]\nE = 1\nnu = 0.3\n{material}\n\
                 [section.s]\nshape = \"circle\"\nradius = 0.1\nmaterial = \"m\"\n\
                 [[beam]]\nname = \"arm\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 1000\n\
                 [[stage]]\nkind = \"static\"\n[output]\nenvelope = {envelope}\n"
            )
        };
        let bytes = |material: &str, envelope: bool| {
            let (read, _) = deck::read(&deck(material, envelope)).expect("a deck");
            need(&read).bytes
        };
        let none = bytes("", false);
        for (material, values) in [("", 1.0), ("strength = 1", 1.0), ("strain_limit = 0.1", 2.0)] {
            let more = bytes(material, true) - none;
            assert_eq!(more, values * 1000.0 * 128.0 * 88.0, "{material}");
        }
    }

    #[test]
    fn a_group_has_what_the_groups_around_it_have() {
        let files = |path: &Path| {
            let text = match path.to_str()? {
                "/sys/fs/cgroup/a/b/memory.max" => "max",
                "/sys/fs/cgroup/a/b/memory.current" => "10",
                "/sys/fs/cgroup/a/memory.max" => "1000",
                "/sys/fs/cgroup/a/memory.current" => "300",
                "/sys/fs/cgroup/a/memory.stat" => "anon 1\ninactive_file 200\n",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes" => "9223372036854771712",
                "/sys/fs/cgroup/memory/memory.usage_in_bytes" => "5",
                _ => return None,
            };
            Some(text.to_string())
        };
        assert_eq!(group_room("0::/a/b\n", &files).unwrap().bytes, 900.0);
        assert!(group_room("4:memory:/gone\n0::/\n", &files).unwrap().bytes > 1e18);
        assert_eq!(group_room("", &files), None);
    }

    #[test]
    fn numbers_that_fit_are_rounded_down() {
        for (nodes, rounded) in [(123_456.0, 120_000.0), (9.9, 9.0), (0.0, 0.0), (999_999.0, 990_000.0)] {
            assert_eq!(fitting(nodes), rounded);
        }
    }
}
